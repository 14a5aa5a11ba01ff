"""Time constants of the catalogue, which are those of machine tools, fitted to how long recordings last."""

from __future__ import annotations

from dataclasses import replace

from discovery.mismatch.catalogue.effect import Effect, Shape

USUAL = 4 * 86400.0  # s, of recordings up to which the slowest mass is that of a machine tool
SHORTEST = 1 / 60  # of the longest recording: a body that small may be what was recorded
FURTHEST = 1 / 10  # of the longest recording, for a clock

LAGS = (1800.0, 7200.0)  # s, of what follows an input slowly, in a formula that names no cause


def lags(duration: float) -> tuple[float, ...]:
    """Time constants of a description that recordings of `duration` [s] can show."""
    share = min(1.0, FURTHEST * duration / LAGS[-1])
    return tuple(share * lag for lag in LAGS)


def scaled(effect: Effect, duration: float) -> Effect:
    """The effect with time constants that recordings of `duration` [s] can show.

    In three days on a machine nothing changes. Ten minutes of a small motor may hold a mass of seconds, and
    no clock that is two hours late; two weeks of a house hold walls of a day.
    """
    longer = max(1.0, duration / USUAL) if effect.word == "second_thermal_mass" else 1.0
    return replace(effect, shapes=tuple(_scaled(shape, duration, longer) for shape in effect.shapes))


def _scaled(shape: Shape, duration: float, longer: float) -> Shape:
    if shape.unit != "s" or shape.fixed:
        return shape
    if shape.low < 0:
        low, high = max(shape.low, -FURTHEST * duration), min(shape.high, FURTHEST * duration)
        grid = tuple(value for value in shape.grid if low <= value <= high) or (low / 2, high / 2)
        return replace(shape, low=low, high=high, grid=grid)
    low, high = min(shape.low, SHORTEST * duration), shape.high * longer
    first = () if low == shape.low else (3 * low,)
    last = () if high == shape.high else (high / 3,)
    return replace(shape, low=low, high=high, grid=(*first, *shape.grid, *last))
