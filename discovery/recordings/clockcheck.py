"""Stamps: does time run forward, step by step."""

from pathlib import Path

import numpy as np

from discovery.recordings.columns import Columns
from discovery.recordings.finding import Finding

_JUMP = 20.0  # a step of so many usual steps is no irregular stamp any more


def clock_findings(file: Path, columns: Columns) -> list[Finding]:
    """Stamps that run backwards or come twice (errors), and jumps (a warning)."""
    steps = np.diff(columns.time)
    findings = []
    if (back := np.flatnonzero(steps < 0)).size:
        what = f"time runs backwards by {-steps[back[0]]:g} s{_more(back)}"
        do = "sort the lines, or record with a clock that is not put back (UTC)"
        findings.append(Finding("error", file, int(columns.lines[back[0] + 1]), what, do))
    if (twice := np.flatnonzero(steps == 0)).size:
        what = f"the stamp of the line before comes again{_more(twice)}"
        do = "delete one of the two, or write the stamps with more digits"
        findings.append(Finding("error", file, int(columns.lines[twice[0] + 1]), what, do))
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if forward.size else 0.0
    if (jumps := np.flatnonzero(steps > _JUMP * usual)).size and usual > 0:
        what = f"time jumps by {steps[jumps[0]]:g} s where steps are {usual:g} s{_more(jumps)}"
        do = "inputs are held over the gap: split the recording there if the machine did not stand still"
        findings.append(Finding("warning", file, int(columns.lines[jumps[0] + 1]), what, do))
    return findings


def _more(places: np.ndarray[tuple[int], np.dtype[np.int64]]) -> str:
    return f" (and {places.size - 1} more like it)" if places.size > 1 else ""
