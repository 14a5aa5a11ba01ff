"""The folder of a run: which entries a run owns in it, how they are replaced at once, and read back."""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.files import read_text

RESULTS, DIAGNOSIS, INPUTS = "results.json", "diagnosis.json", "inputs.json"
OWNED = frozenset({RESULTS, DIAGNOSIS, INPUTS, "report.html", "paper.html", "models", "predictions"})
_KEYS: dict[str, dict[str, type]] = {
    RESULTS: {"experiment": str, "fit": list, "held_out": list, "models": dict},
    DIAGNOSIS: {"model": str, "verdict": str, "physics": list},
}


def default_folder(experiment: str) -> Path:
    """Where results go unless the user says otherwise: what cannot be part of a folder's name becomes "_".

    >>> default_folder("mill, X axis: 3/4").name
    'mill_ X axis_ 3_4'
    """
    return Path("runs") / re.sub(r"[^\w .+-]+", "_", experiment).lstrip(" ._+-")[:100].rstrip()


def made_at(folder: Path, names: Sequence[str] = (RESULTS, DIAGNOSIS)) -> str:
    """Day and time when the newest of these files in a run's folder was written; empty without one."""
    made = [path.stat().st_mtime for name in names if (path := folder / name).is_file()]
    return datetime.fromtimestamp(max(made)).strftime("%Y-%m-%d %H:%M") if made else ""


def replacing(folder: Path, verb: str = "run") -> str:
    """A sentence on what a run (or a diagnosis) replaces in a folder; empty where nothing is lost."""
    what, name = ("run", RESULTS) if verb == "run" else ("diagnosis", DIAGNOSIS)
    made = made_at(folder, [name])
    return f"this replaces the {what} of {made} in {folder} (keep both with --out)" if made else ""


def read_results(folder: Path) -> dict[str, Any]:
    """Content of a run's results.json. Raises UserError where there is none, or a broken one."""
    return _read(folder, RESULTS)


def read_diagnosis(folder: Path) -> dict[str, Any]:
    """Content of a run's diagnosis.json. Raises UserError where there is none, or a broken one."""
    return _read(folder, DIAGNOSIS)


def _read(folder: Path, name: str) -> dict[str, Any]:
    path = Path(folder) / name
    if not path.is_file():
        verb = "run" if name == RESULTS else "diagnose"
        raise UserError(f"{folder}: no {name} there; name the folder of a finished `discovery {verb}`")
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        line = f", line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        what = error.msg if isinstance(error, json.JSONDecodeError) else str(error)
        raise UserError(f"{path}{line}: not valid JSON ({what}); make the run again") from None
    found: dict[str, Any] = content if isinstance(content, dict) else {}
    for key, kind in _KEYS[name].items():
        if not isinstance(found.get(key), kind):
            raise UserError(f"{path}: the key '{key}' is missing or wrong; make the run again")
    return found


@contextmanager
def staged(folder: Path) -> Iterator[Path]:
    """A temporary folder next to `folder` that takes its place when the block ends well, and vanishes when
    not.

    What a run owns in `folder` is replaced as a whole; everything else there (exports, figures, notes) is
    taken along.

    Raises UserError: `folder` holds something else than the results of a run, or cannot be written.
    """
    _refuse_foreign(folder)
    place = folder.resolve()  # behind a link the results change, not the link
    with temporary_folder(folder) as temporary:
        yield temporary
        if place.exists():
            _take_along(place, temporary)
        _take_place(temporary, place)


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """A temporary folder next to `folder` that vanishes at the end, whatever happens. What a killed process
    left of such a folder is cleared away first.

    Raises UserError: it cannot be written.
    """
    place = folder.resolve()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        _clear(place)
        temporary = Path(tempfile.mkdtemp(dir=place.parent, prefix=f"{_mark(place)}{os.getpid()}."))
    except OSError as error:
        raise UserError(
            f"{folder}: cannot be written ({error.strerror}); choose another place with --out"
        ) from None
    try:
        temporary.chmod(0o755)
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _mark(place: Path) -> str:
    """What the temporary folders of this computer next to a place begin with; the number of a process
    follows.
    """
    host = re.sub(r"[^\w-]", "_", platform.node())
    return f".{place.name}.{host}."


def _clear(place: Path) -> None:
    """Remove what killed processes left; a place that was being replaced when one was killed comes back."""
    mark = _mark(place)
    for entry in place.parent.iterdir():
        number = entry.name.removeprefix(mark).partition(".")[0]
        if not entry.name.startswith(mark) or not number.isdecimal() or _alive(int(number)):
            continue
        if entry.name.endswith(".old") and not place.exists():
            entry.replace(place)
        else:
            shutil.rmtree(entry, ignore_errors=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's, or no number of a process
        return True
    return True


def _refuse_foreign(folder: Path) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise UserError(f"{folder}: this is a file; name a folder with --out")
    content = {entry.name for entry in folder.iterdir()}
    if content and not content & {RESULTS, DIAGNOSIS}:
        raise UserError(
            f"{folder}: this folder holds something else than results; name another one with --out"
        )


def _take_along(old: Path, new: Path) -> None:
    """What a run does not own, as hard links: nothing in `old` is touched before `new` is whole."""
    try:
        for entry in old.iterdir():
            if entry.name in OWNED:
                continue
            if entry.is_dir() and not entry.is_symlink():
                shutil.copytree(entry, new / entry.name, symlinks=True, copy_function=_link)
            else:
                _link(entry, new / entry.name)
    except OSError as error:
        raise UserError(
            f"{old}: other files in this folder cannot be kept ({error}); "
            "nothing was changed. Choose another folder with --out"
        ) from None


def _link(source: str | Path, target: str | Path) -> None:
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:  # a file system without hard links, or somebody else's file
        shutil.copy2(source, target, follow_symlinks=False)


def _take_place(new: Path, place: Path) -> None:
    """`new` instead of what stands at `place`, which comes back if that fails."""
    old = new.with_name(f"{new.name}.old")
    try:
        if place.exists():
            place.replace(old)
        new.replace(place)
    except BaseException:
        if old.exists() and not place.exists():
            old.replace(place)
        raise
    shutil.rmtree(old, ignore_errors=True)
