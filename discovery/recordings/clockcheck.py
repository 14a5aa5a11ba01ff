"""Stamps: does time run forward, step by step, and in seconds."""

from pathlib import Path

import numpy as np

from discovery.recordings.columns import Columns
from discovery.recordings.finding import Finding, line_of, more

_JUMP = 20.0  # a step of so many usual steps is no irregular stamp any more
_SHORTEST = 3  # rows
_LONG = 60 * 86400.0  # s: no thermal recording in one piece; 8 h in milliseconds are 333 days
_SHORT = 1.0  # s: no thermal recording either; 12 h in days are 0.5


def clock_findings(file: Path, columns: Columns, *, pauses: bool = False) -> list[Finding]:
    """Stamps that run backwards or come twice (errors), too few rows (an error), jumps, and stamps that are
    hardly seconds (warnings). `pauses`: the logger pauses while nothing changes, so jumps are none.
    """
    steps = np.diff(columns.time)
    findings = []
    if columns.time.size < _SHORTEST:
        what = f"only {columns.time.size} row{'s' * (columns.time.size != 1)}"
        findings.append(Finding("error", file, None, what, "too short for any model: record longer"))
    if (back := np.flatnonzero(steps < 0)).size:
        row = int(back[0]) + 1
        what = f"time runs backwards by {-steps[back[0]]:g} s{more(back.size)}"
        do = "sort the lines, or record with a clock that is not put back (UTC)"
        if (same := np.flatnonzero(columns.time[:row] == columns.time[row])).size:
            what += f", to the stamp of {line_of(file, int(columns.lines[same[0]]))}, with other values"
            do = "delete the wrong one of each two lines, or record with a clock that is not put back (UTC)"
        findings.append(Finding("error", file, int(columns.lines[row]), what, do))
    if (twice := np.flatnonzero(steps == 0)).size:
        what = f"the time stamp of the line before is repeated{more(twice.size)}"
        do = "delete one of the two, or write the stamps with more digits"
        findings.append(Finding("error", file, int(columns.lines[twice[0] + 1]), what, do))
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if forward.size else 0.0
    if (jumps := np.flatnonzero(steps > _JUMP * usual)).size and usual > 0 and not pauses:
        what = f"time jumps by {steps[jumps[0]]:g} s where steps are {usual:g} s{more(jumps.size)}"
        do = "nothing is known of the gap: fits allow for what inputs did; split the recording if it is long"
        findings.append(Finding("warning", file, int(columns.lines[jumps[0] + 1]), what, do))
    if columns.origin is None and usual > 0:
        findings += _unit_findings(file, columns, usual)
    return findings


def _unit_findings(file: Path, columns: Columns, usual: float) -> list[Finding]:
    """Numbers of another unit than seconds, by their length and usual step (an instant has none)."""
    length = float(np.max(columns.time) - np.min(columns.time))
    first = int(columns.lines[0])
    whole = abs(usual / 1000.0 - round(usual / 1000.0)) < 0.02 and usual > 500.0  # hourly stamps are not
    hours = abs(usual / 3600.0 - round(usual / 3600.0)) < 1e-6  # a gauge that is read once a day
    if length > _LONG and (whole or usual > 10e3) and not hours:
        what = f"a stamp every {usual:g} s over {length / 86400:.3g} days: perhaps these are milliseconds"
        return [Finding("warning", file, first, what, "write the time in seconds: divide it by 1000")]
    if length < _SHORT or usual < 1e-3:
        what = (
            f"{columns.time.size} rows within {length:.3g} s: perhaps these are days, as spreadsheets count"
        )
        return [Finding("warning", file, first, what, "write the time in seconds: multiply it by 86400")]
    return []
