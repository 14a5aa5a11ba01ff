"""A compensator's memory on disk: checksum, hash of the model, atomic rename, the copy before kept."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.stepper import Snapshot
from discovery.runtime.compensator import Compensator, State
from discovery.runtime.observer import Observer

NAMES = ("state.json", "state.previous.json")
# What a guard remembers
KEPT = (
    *("held", "held_at", "mean", "fresh", "seen", "seen_at", "still_since"),
    *("waiting", "waiting_from", "stayed"),
)


FUTURE_S = 60.0  # a saved state that claims to be later than now by more is refused


class Lock:
    """One writer a folder: held until it is closed, or until the process ends.

    Raises:
        UserError: another process holds it.
    """

    def __init__(self, folder: Path) -> None:
        import fcntl

        folder.mkdir(parents=True, exist_ok=True)
        self.file = (folder / "lock").open("a+")
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.file.seek(0)
            owner = self.file.read().strip() or "another process"
            self.file.close()
            raise UserError(
                f"{folder}: another compensation already uses this folder ({owner}); stop it first, or "
                "name another folder with --state"
            ) from None
        self.file.truncate(0)
        self.file.write(f"process {os.getpid()}")
        self.file.flush()

    def close(self) -> None:
        """Let go."""
        self.file.close()


def save(
    compensator: Compensator,
    folder: Path,
    background: Executor | None = None,
    *,
    more: Mapping[str, Any] | None = None,
    first: Callable[[], object] = lambda: None,
) -> Future[None]:
    """Write the state of a compensator; what was there before becomes the previous copy.

    A crash at any instant leaves at least one whole copy.

    Args:
        background: writes in a thread of its own (one worker), so that a slow disk delays no tick.
        more: what else belongs to the state (see `Saved`).
        first: what has to be on the disk before the state says so.

    Returns:
        What became of it: an OSError where the disk did not take it.
    """
    body = json.dumps(_content(compensator) | {"more": dict(more or {})}, allow_nan=True)

    def work() -> None:
        first()
        _write(body, folder)

    if background is not None:
        return background.submit(work)
    done: Future[None] = Future()
    try:
        work()
        done.set_result(None)
    except OSError as error:
        done.set_exception(error)
    return done


def _write(body: str, folder: Path) -> None:
    data = json.dumps({"sha256": hashlib.sha256(body.encode()).hexdigest(), "body": body})
    folder.mkdir(parents=True, exist_ok=True)
    new, (now, before) = folder / "state.new", (folder / name for name in NAMES)
    with new.open("w", encoding="utf-8") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    if now.exists():
        now.replace(before)
    new.replace(now)
    place = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(place)  # the names as well: a power cut leaves the old copy or the new one
    finally:
        os.close(place)


@dataclass(frozen=True)
class Saved:
    """What a saved state says of itself: its instant [s], bytes of the output at that instant, and the
    clock it was saved with (see `Clock.saved`)."""

    time: float
    output: int | None
    clock: Mapping[str, Any]


def peek(compensator: Compensator, folder: Path) -> Saved | None:
    """What the newest whole copy of this model's state says of itself."""
    for name in NAMES:
        content = _read(folder / name)
        if content is not None and content["model"] == compensator.exported.seal.sha256:
            return _saved(content)
    return None


def restore(compensator: Compensator, folder: Path, now: float = math.inf) -> Saved | None:
    """Go on from the newest whole copy of this model's state that is not from after `now` [s]; None where
    there is none.

    The offsets go on from where they were; the model catches up with the next tick, through a gap by
    fast-forward.
    """
    for name in NAMES:
        content = _read(folder / name)
        if content is None or content["model"] != compensator.exported.seal.sha256:
            continue
        if float(content["time"]) > now + FUTURE_S:
            continue
        try:
            _apply(compensator, content)
        except Exception:  # a copy that is whole but does not fit: the older one may
            continue
        return _saved(content)
    return None


def _saved(content: Mapping[str, Any]) -> Saved:
    more = content.get("more", {})
    return Saved(float(content["time"]), more.get("output"), more.get("clock", {}))


def succeed(compensator: Compensator, folder: Path) -> bool:
    """Begin where another model stopped, if its state was saved: states of the same name, and the offsets
    without a step.
    """
    for name in NAMES:
        content = _read(folder / name)
        if content is not None and content["model"] != compensator.exported.seal.sha256:
            compensator.succeed(content["states"], content["named_offsets"])
            return True
    return False


def _content(c: Compensator) -> dict[str, Any]:
    snapshot = {
        key: value.tolist() if isinstance(value, np.ndarray) else value
        for key, value in asdict(c.stepper.snapshot()).items()
    }
    return {
        "model": c.exported.seal.sha256,
        "states": c.states(),
        "named_offsets": dict(zip(c.names, c.offsets, strict=True)),
        "time": c.last,
        "origin": c.origin,
        "state": c.state.name,
        "since": c.since,
        "settling": c.settling.name,
        "started_at": c.started_at,
        "offsets": c.offsets,
        "bump": c.bump,
        "predicted": None if c.predicted is None else c.predicted.tolist(),
        "inputs": None if c.inputs is None else c.inputs.tolist(),
        "good_since": c.good_since,
        "gain": c.gain,
        "held": [[getattr(guard, name) for name in KEPT] for guard in c.guards],
        "snapshot": snapshot,
        "observer": None if c.observer is None else c.observer.saved(),
    }


def _read(path: Path) -> dict[str, Any] | None:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if hashlib.sha256(data["body"].encode()).hexdigest() != data["sha256"]:
            return None
        content: dict[str, Any] = json.loads(data["body"])
        whole = isinstance(content["model"], str) and math.isfinite(_saved(content).time)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
        return None
    return content if whole else None


def _apply(c: Compensator, content: dict[str, Any]) -> None:
    saved = content["snapshot"]
    arrays = {key: np.array(saved[key], dtype=float) for key in ("x", "carry", "delayed", "plays", "ring")}
    snapshot = Snapshot(
        **arrays, position=np.array(saved["position"], dtype=np.int64), count=int(saved["count"])
    )
    numbers = [*content["offsets"], *content["bump"], *snapshot.x]
    if not all(math.isfinite(value) for value in numbers) or len(content["offsets"]) != len(c.places):
        raise ValueError("not finite")
    found: dict[str, Any] = {
        "last": float(content["time"]),
        "origin": _number(content["origin"]),
        "state": State[content["state"]],
        "since": float(content["since"]),
        "settling": State[content["settling"]],
        "started_at": float(content["started_at"]),
        "offsets": [float(v) for v in content["offsets"]],
        "bump": [float(v) for v in content["bump"]],
        "predicted": _numbers(content["predicted"], len(c.exported.outputs)),
        "inputs": _numbers(content["inputs"], len(c.exported.inputs)),
        "good_since": _number(content["good_since"]),
        "gain": float(content["gain"]),
        "heartbeat": 1,
    }
    held = [dict(zip(KEPT, kept, strict=True)) for kept in content["held"]]
    pairs = list(zip(c.guards, held, strict=True))
    observer = content.get("observer")
    restored = c.stepper.twin()
    restored.restore(snapshot)
    found["observer"] = None if observer is None else Observer.resumed(observer, restored, c.level)
    c.stepper.restore(snapshot)  # nothing is changed by a copy that does not fit
    for name, value in found.items():
        setattr(c, name, value)
    for guard, kept in pairs:
        for name, value in kept.items():
            setattr(guard, name, value)


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _numbers(values: Any, count: int) -> NDArray[np.float64] | None:
    """An array (count,) of numbers. Raises ValueError: another shape."""
    return None if values is None else np.array(values, dtype=float).reshape(count)
