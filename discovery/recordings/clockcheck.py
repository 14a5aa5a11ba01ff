"""Stamps: does time run forward, step by step."""

from pathlib import Path

import numpy as np

from discovery.recordings.columns import Columns
from discovery.recordings.finding import Finding, more

_JUMP = 20.0  # a step of so many usual steps is no irregular stamp any more
_SHORTEST = 3  # rows


def clock_findings(file: Path, columns: Columns) -> list[Finding]:
    """Stamps that run backwards or come twice (errors), jumps (a warning), too few rows (an error)."""
    steps = np.diff(columns.time)
    findings = []
    if columns.time.size < _SHORTEST:
        what = f"only {columns.time.size} row{'s' * (columns.time.size != 1)}"
        findings.append(Finding("error", file, None, what, "too short for any model: record longer"))
    if (back := np.flatnonzero(steps < 0)).size:
        what = f"time runs backwards by {-steps[back[0]]:g} s{more(back.size)}"
        do = "sort the lines, or record with a clock that is not put back (UTC)"
        findings.append(Finding("error", file, int(columns.lines[back[0] + 1]), what, do))
    if (twice := np.flatnonzero(steps == 0)).size:
        what = f"the stamp of the line before comes again{more(twice.size)}"
        do = "delete one of the two, or write the stamps with more digits"
        findings.append(Finding("error", file, int(columns.lines[twice[0] + 1]), what, do))
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if forward.size else 0.0
    if (jumps := np.flatnonzero(steps > _JUMP * usual)).size and usual > 0:
        what = f"time jumps by {steps[jumps[0]]:g} s where steps are {usual:g} s{more(jumps.size)}"
        do = "inputs are held over the gap: split the recording there if the machine did not stand still"
        findings.append(Finding("warning", file, int(columns.lines[jumps[0] + 1]), what, do))
    return findings
