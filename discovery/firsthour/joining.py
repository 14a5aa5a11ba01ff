"""Two loggers of one recording, each with its own clock and rate: one table, the shift between them
estimated.

What one logger reads drives what the other reads, so the right shift is the one at which the second can be
predicted best from the past of the first. Too early a driver is no cause, too late a one misses the onset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.firsthour.table import Column, OwnTable
from discovery.recordings.responses import filtered

Array = NDArray[np.float64]

_POINTS = 3000  # of the common grid
_LAGS = (0.0, 0.01, 0.03, 0.1, 0.3)  # of the overlap: time constants of the responses
_MOST = 0.25  # of the shorter recording: shifts that are tried
_SHIFTS = 121
_RIDGE = 1e-6
_GAIN = 12.0  # twice the gain in log likelihood from which a shift is believed
_DIFFER = 4.0  # times its spread: a shift that is so far from the others is another one
_APART = 30  # points of the grid that count as one: residuals hang together


@dataclass(frozen=True)
class Shift:
    """`seconds` to add to the second clock, within `spread`; `seen`: the recordings show it; `shared`:
    other pairs do.
    """

    seconds: float
    spread: float
    seen: bool
    shared: bool = False

    @property
    def known(self) -> bool:
        """Whether the pair says anything of its shift, none included."""
        return bool(np.isfinite(self.spread))


def join_all(firsts: Sequence[OwnTable], seconds: Sequence[OwnTable]) -> list[OwnTable]:
    """Each table of the first logger with that of the second.

    The clocks are the same in all pairs with dates. If their shifts agree, all pairs take the mean.

    Raises:
        UserError: two tables do not overlap, or one has no partner.
    """
    if len(firsts) != len(seconds):
        raise UserError(
            f"{len(firsts)} tables of one logger and {len(seconds)} of the other; name one --join for "
            "each --from"
        )
    pairs = [(a, b, *_offset(a, b)) for a, b in zip(firsts, seconds, strict=True)]
    shifts = [estimate_shift(a, replace(b, time=b.time + offset)) for a, b, offset, _ in pairs]
    dated = len(pairs) > 1 and all(a.first and b.first for a, b, *_ in pairs)  # else each pair began anew
    common = _common(shifts) if dated else None
    return [
        _joined(a, b, offset, how, common or shift)
        for (a, b, offset, how), shift in zip(pairs, shifts, strict=True)
    ]


def _common(shifts: Sequence[Shift]) -> Shift | None:
    """The mean shift of the pairs that show one, weighed by how well each is known; None where they
    differ.
    """
    known = [one for one in shifts if one.known]
    if not known:
        return None
    weights = np.array([one.spread**-2 for one in known])
    values = np.array([one.seconds for one in known])
    mean, spread = float(weights @ values / weights.sum()), float(weights.sum() ** -0.5)
    if (np.abs(values - mean) > _DIFFER * np.array([one.spread for one in known])).any():
        return None
    return Shift(mean, spread, any(one.seen for one in known), shared=True)


def _joined(first: OwnTable, second: OwnTable, offset: float, how: str, shift: Shift) -> OwnTable:
    """Return one table with the stamps of both. A cell is empty if its logger has no reading then."""
    moved = second.time + offset + (shift.seconds if shift.seen else 0.0)
    if not _overlap(first, second, moved[0] - second.time[0]):
        raise UserError(
            f"{second.path}: does not overlap with {first.path} ({how}); join files of the same hours"
        )
    time = np.union1d(first.time, moved)
    taken = {column.name for column in first.columns}
    columns = [_on(column, first.time, time) for column in first.columns]
    for column in second.columns:
        name = column.name if column.name not in taken else f"{column.name}_2"
        columns.append(_on(replace(column, name=name), moved, time))
    note = f"joined with {second.path.name}, {how}; {_said(shift, second)}"
    notes = (*first.notes, *(f"{second.path.name}: {one}" for one in second.notes), note)
    return replace(first, time=time - time[0], columns=tuple(columns), notes=notes, first=first.first)


def _offset(first: OwnTable, second: OwnTable) -> tuple[float, str]:
    """Seconds from the first row of one to that of the other, by their dates where both have them."""
    if first.first and second.first:
        seconds = [_apart(a, b) for a in (first.first, *first.others) for b in (second.first, *second.others)]
        usual = seconds[0]
        best = next((one for one in seconds if _overlap(first, second, one)), usual)
        how = "" if best == usual else ", with day and month of one in the other order (?)"
        return best, f"by the dates of both{how}"
    return 0.0, "assumed to begin together, because not both have dates"


def _apart(first: str, second: str) -> float:
    """Seconds between two instants."""
    return (datetime.fromisoformat(second) - datetime.fromisoformat(first)).total_seconds()


def _overlap(first: OwnTable, second: OwnTable, offset: float) -> bool:
    """Whether two tables share hours, with the second one begun so many seconds after the first."""
    return bool(second.time[-1] + offset >= first.time[0] and second.time[0] + offset <= first.time[-1])


def _said(shift: Shift, second: OwnTable) -> str:
    size = f"{abs(shift.seconds):.3g} s (95 %: ±{1.96 * shift.spread:.2g} s)"
    if shift.seen:
        where = ", as in the other pairs," if shift.shared else ""
        return (
            f"its clock was {'behind' if shift.seconds > 0 else 'ahead'} by {size}{where} and was corrected"
        )
    if np.isfinite(shift.spread):
        return f"no shift between the clocks is seen (at most about {2 * shift.spread:.2g} s)"
    return f"whether the clock of {second.path.name} is shifted cannot be determined (?)"


def _on(column: Column, stamps: Array, time: Array) -> Column:
    values = np.full(len(time), np.nan)
    values[np.searchsorted(time, stamps)] = column.values
    return replace(column, values=values)


def estimate_shift(first: OwnTable, second: OwnTable) -> Shift:
    """The shift of the second clock with which each table is predicted best from the past of the other."""
    low, high = max(first.time[0], second.time[0]), min(first.time[-1], second.time[-1])
    length = high - low
    if length <= 0:
        return Shift(0.0, np.inf, False)
    drivers, answers = _jumpy(first), _slow(second)
    back = not (drivers and answers)
    if back:
        drivers, answers = _jumpy(second), _slow(first)
    if not (drivers and answers):
        return Shift(0.0, np.inf, False)
    one, other = (second, first) if back else (first, second)
    grid = np.linspace(low, high, min(_POINTS, 2 * max(len(one.time), len(other.time))))
    step = grid[1] - grid[0]
    inside = grid[(grid > low + _MOST * length) & (grid < high - _MOST * length)]
    targets = [_rates(other.time, column.values, inside, 3 * step) for column in answers]
    # rates: what the answers do next, so that a slow drift counts for little
    shifts = np.linspace(-_MOST * length, _MOST * length, _SHIFTS)
    cost = np.array([_cost(one.time, drivers, inside, s, targets, length) for s in shifts])
    best = float(shifts[np.argmin(cost)])
    fine = best + np.linspace(-1, 1, 81) * (shifts[1] - shifts[0])
    cost_fine = np.array([_cost(one.time, drivers, inside, s, targets, length) for s in fine])
    best = float(fine[np.argmin(cost_fine)])
    count = len(inside) * len(targets) / _APART
    at_zero = _cost(one.time, drivers, inside, 0.0, targets, length)
    gain = count * (at_zero - cost_fine.min())
    near = np.concatenate((fine, shifts))[np.concatenate((cost_fine, cost)) < cost_fine.min() + 3.84 / count]
    spread = max(float(np.ptp(near)) / 3.92, step / 2)
    # drivers are shifted by s to fit: the answers of the second table are late by -s
    seconds = best if back else -best
    edge = abs(best) > 0.98 * _MOST * length
    explained = 1 - np.exp(cost_fine.min() / len(targets))
    if edge or explained < 0.05:
        return Shift(0.0, np.inf, False)
    return Shift(seconds, spread, bool(gain > _GAIN and abs(seconds) > 1.96 * spread))


def _jumpy(table: OwnTable) -> list[Column]:
    from discovery.firsthour.shapes import shape

    return [c for c in table.columns if (form := shape(c.values)) and form.span > 0 and not form.slow]


def _slow(table: OwnTable) -> list[Column]:
    from discovery.firsthour.shapes import shape

    return [c for c in table.columns if (form := shape(c.values)) and form.slow]


def _rates(stamps: Array, values: Array, grid: Array, width: float) -> Array:
    """Central differences of a column over a width, scaled to unit variance."""
    known = np.isfinite(values)
    ahead, behind = (np.interp(grid + w, stamps[known], values[known]) for w in (width / 2, -width / 2))
    rates = ahead - behind
    return np.asarray((rates - rates.mean()) / (rates.std() or 1.0))


def _cost(
    stamps: Array, drivers: list[Column], grid: Array, shift: float, targets: list[Array], length: float
) -> float:
    """Return how badly the shifted drivers explain the rates of the answers: the log of the remaining
    share, summed over the answers.
    """
    step = grid[1] - grid[0]
    features = [np.ones(len(grid))]
    start = grid[0] - _MOST * length
    early = np.arange(start, grid[-1] + step / 2, step)
    for column in drivers:
        known = np.isfinite(column.values)
        at = np.searchsorted(stamps[known], early - shift, side="right") - 1
        held = column.values[known][np.maximum(at, 0)]
        features += [_filtered(held, step, lag * length)[-len(grid) :] for lag in _LAGS]
    F = np.column_stack(features)
    F = F / (np.linalg.norm(F, axis=0) + 1e-30)
    gram = F.T @ F + _RIDGE * np.eye(F.shape[1])
    total = 0.0
    for target in targets:
        left = target - F @ np.linalg.solve(gram, F.T @ target)
        total += float(np.log(max(np.mean(left**2), 1e-12)))
    return total


def _filtered(values: Array, step: float, lag: float) -> Array:
    """Return what a change of the input does to the rate of a first-order answer: the input through a high
    pass.
    """
    return values - filtered(values, step, lag) if lag else values
