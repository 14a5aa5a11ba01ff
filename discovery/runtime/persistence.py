"""A compensator's memory on disk: checksum, hash of the model, atomic rename, the copy before kept."""

from __future__ import annotations

import hashlib
import json
import math
import os
from concurrent.futures import Executor, Future
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from discovery.export.stepper import Snapshot
from discovery.runtime.compensator import Compensator, State

NAMES = ("state.json", "state.previous.json")
# What a guard remembers
KEPT = ("held", "held_at", "fresh", "seen", "seen_at", "still_since", "waiting", "waiting_from", "stayed")


def save(compensator: Compensator, folder: Path, beside: Executor | None = None) -> Future[None]:
    """Write the state of a compensator; what was there before becomes the previous copy.

    A crash at any instant leaves at least one whole copy.

    Args:
        beside: writes in a thread of its own (one worker), so that a slow disk delays no tick.

    Returns:
        What became of it: an OSError where the disk did not take it.
    """
    body = json.dumps(_content(compensator), allow_nan=True)
    if beside is not None:
        return beside.submit(_write, body, folder)
    done: Future[None] = Future()
    try:
        _write(body, folder)
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


def restore(compensator: Compensator, folder: Path) -> float | None:
    """Go on from the newest whole copy of this model's state; returns its instant [s], None where there is
    none.

    The offsets go on from where they were; the model catches up with the next tick, through a gap by
    fast-forward.
    """
    for name in NAMES:
        content = _read(folder / name)
        if content is not None and content["model"] == compensator.exported.seal.sha256:
            try:
                _apply(compensator, content)
            except Exception:  # a copy that is whole but does not fit: the older one may
                continue
            return float(content["time"])
    return None


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
    }


def _read(path: Path) -> dict[str, Any] | None:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if hashlib.sha256(data["body"].encode()).hexdigest() != data["sha256"]:
            return None
        content: dict[str, Any] = json.loads(data["body"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return content


def _apply(c: Compensator, content: dict[str, Any]) -> None:
    saved = content["snapshot"]
    arrays = {key: np.array(saved[key], dtype=float) for key in ("x", "carry", "delayed", "plays", "ring")}
    snapshot = Snapshot(
        **arrays, position=np.array(saved["position"], dtype=np.int64), count=int(saved["count"])
    )
    numbers = [*content["offsets"], *content["bump"], *snapshot.x]
    if not all(math.isfinite(value) for value in numbers) or len(content["offsets"]) != len(c.places):
        raise ValueError("not finite")
    c.stepper.restore(snapshot)
    c.last, c.origin = content["time"], content["origin"]
    c.state, c.since = State[content["state"]], content["since"]
    c.settling, c.started_at = State[content["settling"]], content["started_at"]
    c.offsets, c.bump = [float(v) for v in content["offsets"]], [float(v) for v in content["bump"]]
    c.predicted = None if content["predicted"] is None else np.array(content["predicted"])
    c.inputs = None if content["inputs"] is None else np.array(content["inputs"])
    for guard, kept in zip(c.guards, content["held"], strict=True):
        for name, value in zip(KEPT, kept, strict=True):
            setattr(guard, name, value)
    c.good_since, c.gain = content["good_since"], float(content["gain"])
    c.heartbeat = 1
