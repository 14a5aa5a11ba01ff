"""In which unit a clock of bare numbers counts: evidence from how long thermal recordings last, how often
loggers read, how quickly temperatures move, and from the digits of the stamps.
"""

from collections.abc import Sequence

import numpy as np

from discovery.recordings.columns import Array

SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
_HOUR = 3600.0
_TRIED = 200  # stamps that are looked at
_ROUGH = 0.2  # of a part: a stamp that is rounded more roughly says nothing
_MOST = 6.0  # log odds that digits are worth
# log odds before anything is seen: who writes no unit mostly means seconds
_PRIOR = {"s": 0.0, "min": -2.0, "h": -2.5, "ms": -3.5, "us": -4.5, "d": -5.0}
_LENGTH = (np.log(5 * _HOUR), np.log(4.0))  # of a recording [s]: median and spread, both of the logarithm
_STEP = (np.log(15.0), np.log(10.0))  # of a logger [s]
_TOGETHER = 0.7  # correlation of the two: what answers quickly is recorded for a short time
_ANSWER = (np.log(0.5 * _HOUR), np.log(4.0))  # s that a temperature needs for a third of its range
# the same of small things: the winding of a motor, a hot end, electronics; and how often they are recorded
_SMALL_THINGS = ((np.log(600.0), np.log(3.0)), (np.log(2.0), np.log(4.0)), (np.log(60.0), np.log(4.0)))
_OFTEN_SMALL = 0.05
# the same of what is not thermal: a spring, a tank, a motor, a cell
_OTHERS = ((np.log(300.0), np.log(30.0)), (np.log(0.1), np.log(100.0)), (np.log(10.0), np.log(100.0)))
_USUAL_STEPS = (
    0.001,
    0.002,
    0.005,
    0.01,
    0.02,
    0.05,
    0.1,
    0.2,
    0.25,
    0.5,
    1,
    2,
    5,
    10,
    15,
    20,
    30,
    60,
    120,
    180,
    240,
    300,
    600,
    900,
    1200,
    1800,
    3600,
)


def time_odds(
    values: Array, moving: Sequence[Array], interval: float | None = None, *, thermal: float = 1.0
) -> dict[str, float]:
    """Log odds of the units in which a clock counts.

    Args:
        values: (N,) of the clock. moving: each (N,), what was read. interval: of the logger [s], where the
            file states it. thermal: probability that something of a machine's heat is recorded; a spring or a
            tank may take seconds or hours.
    """
    steps = np.diff(values)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    length = float(values[-1] - values[0])
    answers = [a for series in moving if (a := _answer(series, values)) is not None]
    answer = float(np.median(answers)) if answers else None
    odds = {}
    for unit, prior in _PRIOR.items():
        scale = SECONDS[unit]
        kinds = [
            np.log(max(chance, 1e-12))
            + 0.5 * _density(step * scale, of_step)
            + (
                _density(length * scale, of_length)
                if answer is None
                else _both(length * scale, of_length, answer * scale, of_answer)
            )
            for chance, (of_length, of_step, of_answer) in (
                (thermal * (1.0 - _OFTEN_SMALL), (_LENGTH, _STEP, _ANSWER)),
                (thermal * _OFTEN_SMALL, _SMALL_THINGS),
                (1.0 - thermal, _OTHERS),
            )
        ]
        score = prior + float(np.logaddexp.reduce(kinds))
        score += 1.5 * any(abs(step * scale / usual - 1) < 1e-3 for usual in _USUAL_STEPS)
        if interval:
            score += 6.0 * (abs(step * scale / interval - 1) < 0.02)
        odds[unit] = score + _sixtieths(values, unit)
    return odds


def _sixtieths(values: Array, unit: str) -> float:
    """Minutes read each second are 0.0167, 0.0333, ...: sixtieths, which nobody writes in seconds.

    Stamps of whole minutes say nothing. Of the others each that is a sixtieth counts as much as a number
    of so many digits is seldom one by chance.
    """
    parts = {"min": 60.0, "h": 3600.0}.get(unit)
    if parts is None:
        return 0.0
    tried = values[:_TRIED]
    tried = tried[np.abs(tried - np.round(tried, 1)) > 1e-6]
    near = parts * np.array([10.0 ** -len(f"{v:.9g}".partition(".")[2]) for v in tried])  # by rounding
    tried, near = tried[near < _ROUGH], near[near < _ROUGH]
    whole = np.abs(tried * parts - np.round(tried * parts)) < near
    if not tried.size or whole.mean() < 0.95:
        return 0.0
    return float(min(_MOST, -np.log(2 * near[whole]).sum()))


def _answer(series: Array, clock: Array) -> float | None:
    """Return how long a column takes for a third of its range, on this clock. None: it jumps, or it does
    not move.
    """
    known = np.flatnonzero(np.isfinite(series))
    if known.size < 20:
        return None
    x, t = series[known], clock[known]
    span = float(np.ptp(x))
    if span == 0 or np.abs(np.diff(x)).max() > 0.3 * span:
        return None
    lags = np.unique(np.round(np.geomspace(1, known.size // 2, 30)).astype(int))
    for lag in lags:
        if np.percentile(np.abs(x[lag:] - x[:-lag]), 95) > span / 3:
            return float(np.median(t[lag:] - t[:-lag]))
    return None


def _both(a: float, about_a: tuple[float, float], b: float, about_b: tuple[float, float]) -> float:
    """Logarithm of the density of two log-normal values that are small or large together."""
    p, q = ((np.log(max(v, 1e-12)) - m) / s for v, (m, s) in ((a, about_a), (b, about_b)))
    far = (p**2 + q**2 - 2 * _TOGETHER * p * q) / (1 - _TOGETHER**2)
    return float(-0.5 * far - 0.5 * np.log(1 - _TOGETHER**2) - np.log(about_a[1] * about_b[1]))


def _density(value: float, about: tuple[float, float]) -> float:
    """Logarithm of a log-normal density, up to a constant. `about`: median and spread of the logarithm."""
    return float(-0.5 * ((np.log(max(value, 1e-12)) - about[0]) / about[1]) ** 2 - np.log(about[1]))
