"""How well the window of an event was placed in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Spans = Sequence[tuple[float, float]]


def overlap(key: Mapping[str, Any], answer: Mapping[str, Any]) -> float | None:
    """Intersection over union of the true window and all stated ones; None where the key has no window.

    A named event states its window in its parameters; otherwise the windows of `location` count.
    """
    if "window" not in key:
        return None
    recording, start, end = key["window"]
    stated = _named_windows(answer) or [
        (w["recording"], float(w["start_s"]), float(w["end_s"]))
        for w in answer.get("location", {}).get("windows", ())
    ]
    here = merged([(a, b) for run, a, b in stated if run == recording])
    elsewhere = sum(
        b - a
        for run in {r for r, _, _ in stated if r != recording}
        for a, b in merged([(a, b) for r, a, b in stated if r == run])
    )
    both = sum(max(0.0, min(b, end) - max(a, start)) for a, b in here)
    union = (end - start) + sum(b - a for a, b in here) - both + elsewhere
    return float(both / union)


def merged(spans: Spans) -> list[tuple[float, float]]:
    """Spans without overlaps.

    >>> merged([(3.0, 5.0), (0.0, 1.0), (4.0, 6.0)])
    [(0.0, 1.0), (3.0, 6.0)]
    """
    out: list[tuple[float, float]] = []
    for a, b in sorted(spans):
        if out and a <= out[-1][1]:
            out[-1] = (out[-1][0], max(b, out[-1][1]))
        else:
            out.append((a, b))
    return out


def _named_windows(answer: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    out = []
    for f in answer.get("physics") or ():
        edges = {name: p["value"] for name, p in f.get("parameters", {}).items()}
        on = next((v for name, v in edges.items() if name.startswith("t_on")), None)
        off = next((v for name, v in edges.items() if name.startswith("t_off")), None)
        if f.get("recording") and on is not None and off is not None:
            out.append((str(f["recording"]), float(on), float(off)))
    return out
