"""Values: what the role can be, loads below zero, sensors that stand still, lone or too few readings."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import FEW, Array, Lines
from discovery.recordings.finding import Finding, more
from discovery.recordings.oddvalues import impossible_readings
from discovery.recordings.roles import ROLES
from discovery.recordings.standing import longest_run

CONSTANT = "constant"  # kind of finding: a sensor that never moves in a recording

_NEAR_ZERO = 0.05  # of the largest magnitude of a load or flow: so far below zero is noise
# what a channel exceeds somewhere in any recording, and the unit that it has where it does not
_SMALLEST = {
    ("error", "um"): (0.3, "mm"),
    ("heat load", "W"): (2.0, "kW"),
    ("rotation speed", "rpm"): (2.0, "1000 rpm"),
}


def range_findings(file: Path, lines: Lines, channel: Channel, column: Array) -> Iterator[Finding]:
    """Values that the role cannot have (errors) or seldom has (warnings). `column` (T,): canonical unit.

    Of what is left out on loading, only what the role cannot have.
    """
    limits = ROLES[channel.role].ranges.get(channel.unit)
    if limits is None:
        return
    unit = f" {channel.unit}" if channel.unit != "1" else ""
    is_other = channel.role == "other input"  # of these, temperatures alone have limits
    kind = "temperature" if is_other else channel.role
    do = f"check its unit and the sensor; usual is {limits.usual[0]:g} to {limits.usual[1]:g}{unit}"
    impossible = _outside(column, _with_noise(limits.possible, column))
    if impossible.size:
        what = f"'{channel.name}' is {column[impossible[0]]:g}{unit}, no {kind} can be that"
        yield Finding("error", file, int(lines[impossible[0]]), what + more(impossible.size), do)
    known = np.flatnonzero(np.isfinite(column))
    left_out = known[impossible_readings(channel, column[known])]
    outside = _outside(column, _with_noise(limits.usual, column))
    unusual = np.setdiff1d(outside, [*impossible, *left_out]).astype(np.intp)
    if unusual.size:
        a_kind = f"a {kind}" if is_other else f"a channel of role {kind}"
        what = f"'{channel.name}' is {column[unusual[0]]:g}{unit}, unusual for {a_kind}"
        yield Finding("warning", file, int(lines[unusual[0]]), what + more(unusual.size), do)


def below_zero(column: Array) -> Lines:
    """Rows of a heat load that takes heat away, beyond the noise around zero."""
    largest = float(np.nanmax(np.abs(column), initial=0.0))
    return np.flatnonzero(column < -_NEAR_ZERO * largest)


def load_findings(file: Path, lines: Lines, channel: Channel, column: Array) -> Iterator[Finding]:
    """A heat load that is counted below zero: a discharge, a brake, a reversed sign.

    What a controller sends, in percent or steps, may heat and cool in turn; watts of heat may not.
    """
    rows = below_zero(column) if channel.role == "heat load" else np.empty(0, dtype=np.intp)
    if not rows.size or (channel.unit != "W" and np.nanmax(column) > 0.0):
        return
    unit = f" {channel.unit}" if channel.unit != "1" else ""
    what = f"'{channel.name}' is {column[rows[0]]:g}{unit}, a heat load below zero"
    do = "it cools there; if it is heat (a discharge, a brake), write its magnitude"
    yield Finding("warning", file, int(lines[rows[0]]), what + more(rows.size), do)


def _with_noise(limits: tuple[float, float], column: Array) -> tuple[float, float]:
    """Limits with room for the noise of a sensor around zero: a meter of a flow that stands still."""
    largest = float(np.nanmax(column, initial=0.0))
    return (-_NEAR_ZERO * largest, limits[1]) if limits[0] == 0.0 else limits


def _outside(column: Array, limits: tuple[float, float]) -> Lines:
    return np.flatnonzero((column < limits[0]) | (column > limits[1]))  # NaN is neither


def frozen_findings(file: Path, lines: Lines, channel: Channel, column: Array) -> Iterator[Finding]:
    """A sensor that repeats one value far longer than it does elsewhere in the recording (`standing.py`)."""
    known = np.flatnonzero(np.isfinite(column))
    if not channel.is_sensor or known.size < FEW:
        return
    readings = column[known]
    if np.ptp(readings) == 0.0:
        what = f"'{channel.name}' is {readings[0]:g} in all {known.size} readings"
        do = "check the sensor; if it is a constant, say so with set = { ... } in the campaign file"
        yield Finding("warning", file, int(lines[known[0]]), what, do, CONSTANT, channel.name)
        return
    run = longest_run(readings)
    if run is not None and (run.stands or run.hung):
        first, last = known[run.first], known[run.last]
        what = (
            f"'{channel.name}' stays at {column[first]:g} for {run.count} readings,"
            f" up to line {lines[last]}, and changes {_every(1 / run.changes)} elsewhere"
        )
        yield Finding(
            "warning", file, int(lines[first]), what, "check the sensor; empty the cells if it hung"
        )


def said_once(findings: Sequence[Finding], campaign: Path, recordings: int) -> list[Finding]:
    """Findings with one, of the campaign, where a sensor shows the same value in all recordings.

    Args:
        recordings: how many there are.
    """
    found = list(findings)
    for channel in dict.fromkeys(one.channel for one in findings if one.kind == CONSTANT):
        alike = [one for one in findings if (one.kind, one.channel) == (CONSTANT, channel)]
        (said, *others) = {one.what.partition(" in all ")[0] for one in alike}
        if len(alike) == recordings > 1 and not others:
            what = f"{said} in all readings of all {recordings} recordings"
            found = [one for one in found if one not in alike]
            found.append(Finding("warning", campaign, None, what, alike[0].do, CONSTANT, channel))
    return found


def _every(readings: float) -> str:
    """How often a sensor shows something new."""
    return f"every {readings:.2g} readings" if readings >= 1.5 else "with nearly every reading"


def small_findings(file: Path, lines: Lines, channel: Channel, column: Array) -> Iterator[Finding]:
    """Values that move, and by less than any of their role does: another unit, most likely."""
    known = column[np.isfinite(column)]
    least = _SMALLEST.get((channel.role, channel.unit))
    if least is None or known.size < FEW:
        return
    most = float(np.max(np.abs(known)))
    if 0.0 < most < least[0] and known.min() < known.max():
        what = f"'{channel.name}' is never more than {most:.2g} {channel.unit}"
        do = f"on a machine, the role {channel.role} seldom has values so small: is it in {least[1]}?"
        yield Finding("warning", file, int(lines[0]), what, do, "small", channel.name, 5.0)


def few_findings(file: Path, channel: Channel, column: Array) -> Iterator[Finding]:
    """A measured channel with so few readings that no model can be judged by them."""
    count = int(np.isfinite(column).sum())
    if count < FEW:
        what = f"'{channel.name}' has {count or 'no'} reading{'' if count == 1 else 's'}"
        do = f"record longer: at least {FEW} readings carry a model"
        yield Finding("warning", file, None, what, do if count else "look at the sensor and at its column")
