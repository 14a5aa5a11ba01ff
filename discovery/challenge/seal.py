"""The seal of a challenge: what was fixed before anything was solved, as SHA-256 sums that anyone can check.

The file of answers holds a random salt, so that its sum gives nothing away while the cases are being solved.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import discovery
from discovery.errors import UserError
from discovery.files import read_text, write_atomic

SEAL, ANSWERS, CASES = "seal.json", "answers.json", "cases"


def sha256(content: bytes) -> str:
    """Sum of some bytes as hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def source_sums(package: Path | None = None) -> dict[str, str]:
    """Sum of every source file of the package, by its path inside."""
    root = package or Path(discovery.__file__).parent
    files = (
        p for p in root.rglob("*") if p.is_file() and "__pycache__" not in p.parts and p.suffix != ".pyc"
    )
    return {p.relative_to(root).as_posix(): sha256(p.read_bytes()) for p in sorted(files)}


def case_sums(folder: Path) -> dict[str, str]:
    """Sum of every file of every case, by its path inside the folder of cases."""
    cases = folder / CASES
    return {
        p.relative_to(cases).as_posix(): sha256(p.read_bytes())
        for p in sorted(cases.rglob("*"))
        if p.is_file()
    }


def write_seal(folder: Path) -> dict[str, Any]:
    """Seal the cases and answers of a challenge; nothing may have been solved yet."""
    seal = {
        "sealed": datetime.now(UTC).isoformat(timespec="seconds"),
        "version": discovery.__version__,
        "commit": commit(),
        "answers": sha256((folder / ANSWERS).read_bytes()),
        "cases": case_sums(folder),
        "source": source_sums(),
    }
    write_atomic(folder / SEAL, json.dumps(seal, indent=1) + "\n")
    return seal


def read_seal(folder: Path) -> dict[str, Any]:
    """The seal of a challenge. Raises UserError: there is none, or it is damaged."""
    try:
        seal = json.loads(read_text(folder / SEAL))
        if not isinstance(seal, dict):
            raise ValueError
    except ValueError:
        raise UserError(f"{folder / SEAL}: damaged; start a new challenge with another --out") from None
    return seal


def check_seal(folder: Path, seal: Mapping[str, Any]) -> list[str]:
    """Source files that are no longer what was sealed (changed, new or gone).

    Raises:
        UserError: an answer or a case was changed, so that the challenge is void.
    """
    if sha256((folder / ANSWERS).read_bytes()) != seal["answers"]:
        raise UserError(f"{folder / ANSWERS}: not what was sealed; the challenge is void, start a new one")
    for name in _different(seal["cases"], case_sums(folder)):
        raise UserError(
            f"{folder / CASES / name}: not what was sealed; the challenge is void, start a new one"
        )
    return _different(seal["source"], source_sums())


def _different(one: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def commit() -> str | None:
    """Commit that the package runs from, with a plus where files differ from it; None elsewhere."""
    root = Path(discovery.__file__).parent.parent

    def git(*words: str) -> str:
        done = subprocess.run(
            ["git", "-C", str(root), *words], capture_output=True, text=True, check=True, timeout=20
        )
        return done.stdout.strip()

    try:
        changed = git("status", "--porcelain", "--untracked-files=all", "--", "discovery")
        return git("rev-parse", "HEAD") + ("+" if changed else "")
    except (OSError, subprocess.SubprocessError):
        return None
