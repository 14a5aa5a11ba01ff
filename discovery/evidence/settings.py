"""The noise settings that evidence is integrated over: a grid of which each setting is made when it is asked
for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import log

import numpy as np

from discovery.fitting import Noise

# of a grid; one of each coarse state follows, and one of each slower output
AXES = ("jitter", "rough", "slow", "level", "share", "form", "time")
_SIZES = ("level", "share")  # that a coarse state has of its own
JITTER = 12**-0.5  # of a logging interval: a switch that comes anywhere in it

Place = tuple[int, ...]  # on the axes of a grid
Weighted = tuple[tuple[tuple[float, ...], float], ...]  # values of one kind, or of two, each with its weight


@dataclass(frozen=True)
class Prior:
    """Priors of process noise and slow noise (`thresholds.py`)."""

    floor: float  # of the largest rms flow of the model, at level one
    share: float  # of the flow through each state that a usual lumped model is off by
    levels: Mapping[float, float]  # of the heat that nobody records, each with its weight
    shares: Mapping[float, float]  # of what flows through a body, off from hour to hour
    slow: Mapping[float, float]  # slow noise, shares of the reading noise
    forms: Mapping[tuple[float, float], float]  # laws are off; flows act beyond a body
    times: Mapping[float, float]  # time constant of process noise, shares of the longest that is likely


@dataclass(frozen=True)
class Setting:
    """A possible noise, and the logarithm of its prior weight."""

    noise: Noise
    log_weight: float
    level: float  # of the heat that nobody records
    place: Place  # on the grid of jitters, noisy inputs, slow noises, levels, shares, forms, times, coarser
    levels: Mapping[str, float] = field(default_factory=dict)  # of each state that is coarser than the others

    @property
    def is_plain(self) -> bool:
        """Whether it has no slow noise, and the least of errors that grow with the flows."""
        return not any(self.place[2:3] + self.place[4:])


@dataclass(frozen=True)
class Settings:
    """The grid.

    Args:
        white: reading noise, and the longest time constants.
        floor: heat that nobody records of each state at level one, from `floors`.
        axes: jitters, noisy inputs, slow noises, levels, shares, forms and times; then, for each state
            of `coarser`, the steps by which its level and its share are above those of the others.
        coarser: states that may be off by more than the others.
        slower: outputs whose slow noise may be larger than that of the others, by steps that follow.
    """

    white: Noise
    floor: Mapping[str, float]
    axes: tuple[Weighted, ...]
    coarser: tuple[str, ...] = ()
    slower: tuple[str, ...] = ()
    known: dict[Place, Setting] = field(default_factory=dict, init=False, repr=False, compare=False)
    around: dict[Place, list[Place]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def usual(self) -> Setting:
        """The most likely one before the recordings are read."""
        return self.at(tuple(max(range(len(a)), key=lambda k: a[k][1]) for a in self.axes))

    def __iter__(self) -> Iterator[Setting]:
        return map(self.at, np.ndindex(*(len(axis) for axis in self.axes)))

    def at(self, place: Place) -> Setting:
        """The setting at a place."""
        if place not in self.known:
            self.known[place] = self._made(place)
        return self.known[place]

    def _made(self, place: Place) -> Setting:
        (jitter,), (rough,), (slow,), (level,), (share,), (form, edge), (part,), *steps = (
            axis[k][0] for axis, k in zip(self.axes, place, strict=True)
        )
        count = len(self.coarser)
        bodies = {s: int(n) for s, (n,) in zip(self.coarser, steps[:count], strict=True) if n}
        sensors = {y: int(n) for y, (n,) in zip(self.slower, steps[count:], strict=True) if n}
        noise = with_levels(self.white, self.floor, level, share, slow)
        noise = replace(
            noise,
            slow=self._slow(place, sensors) if sensors else noise.slow,
            force={s: self._above(place, s, n) for s, n in bodies.items()} or None,
            jitter=jitter,
            rough=rough,
            form=form,
            edge=edge,
            slow_time=part * self.white.slow_time,
            heat_time=part * self.white.heat_time,
        )
        weights = (log(a[k][1] / sum(w for _, w in a)) for a, k in zip(self.axes, place, strict=True))
        levels = {s: self._up(place, "level", n) for s, n in bodies.items()}
        return Setting(noise, sum(weights), level, place, levels)

    def _above(self, place: Place, state: str, steps: int) -> tuple[float, float]:
        """Heat and share of a state that is coarser by some steps."""
        level, share = (self._up(place, axis, steps) for axis in _SIZES)
        return level * self.floor[state], share

    def _slow(self, place: Place, steps: Mapping[str, int]) -> tuple[float, ...]:
        """Slow noise of each output, where some are slower by some steps."""
        names = zip(self.white.outputs, self.white.white, strict=True)
        return tuple(self._up(place, "slow", steps.get(name, 0)) * white for name, white in names)

    def _up(self, place: Place, axis: str, steps: int) -> float:
        """The value of an axis some steps above a place."""
        k = AXES.index(axis)
        return self.axes[k][min(place[k] + steps, len(self.axes[k]) - 1)][0][0]

    def near(self, place: Place) -> list[Place]:
        """The places one step away, and those where others have less of what one that is worse keeps."""
        if place not in self.around:
            self.around[place] = self._near(place)
        return self.around[place]

    def _near(self, place: Place) -> list[Place]:
        steps = [{axis: step} for axis in range(len(place)) for step in (-1, 1)]
        for own in range(len(AXES), len(place)):
            sizes = _SIZES if own < len(AXES) + len(self.coarser) else ("slow",)
            steps += [{AXES.index(axis): -step, own: step} for axis in sizes for step in (-1, 1)]
        found = [tuple(at + step.get(axis, 0) for axis, at in enumerate(place)) for step in steps]
        return [one for one in found if all(0 <= at < len(a) for at, a in zip(one, self.axes, strict=True))]

    def at_other_times(self, place: Place) -> list[Place]:
        """The place with the other time constants of process noise: with another one, less noise may do as
        much, and no single step leads there.
        """
        k = AXES.index("time")
        return [(*place[:k], t, *place[k + 1 :]) for t in range(len(self.axes[k])) if t != place[k]]

    def closest(self, noise: Noise, allowed: Callable[[Setting], bool]) -> Place:
        """The place most alike to a noise among some, axis by axis: what is allowed, and what is alike, is so
        on each axis for itself.
        """
        place: Place = (0,) * len(self.axes)
        for axis, values in enumerate(self.axes):
            options = [self.at((*place[:axis], k, *place[axis + 1 :])) for k in range(len(values))]
            inside = [one for one in options if allowed(one)]
            place = min(inside, key=lambda one: _distance(one.noise, noise)).place
        return place


def settings(
    white: Noise,
    floor: Mapping[str, float],
    prior: Prior,
    unsure: bool,
    noisy: bool,
    coarser: tuple[str, ...] = (),
    slower: tuple[str, ...] = (),
) -> Settings:
    """The grid of noise settings.

    Args:
        white: reading noise and the two time constants.
        floor: of each state, from `floors`.
        unsure: inputs may be logged late, each switch by another time, or all by the same.
        noisy: inputs may be recorded with noise.
        coarser: states that may be off by more than the others.
        slower: outputs whose slow noise may be larger than that of the others.
    """
    maybe = ((JITTER, unsure), (1.0, noisy))
    chances = [dict.fromkeys([0.0, size] if there else [0.0], 1.0) for size, there in maybe]
    single = [*chances, prior.slow, prior.levels, prior.shares]
    # a body is coarser by a step as often as a model is coarser than usual, and it may be any body
    bodies, sensors = _steps(prior.shares, len(floor)), _steps(prior.slow, len(white.outputs))
    axes = [
        *(tuple(((value,), weight) for value, weight in table.items()) for table in single),
        tuple(prior.forms.items()),
        tuple(((part,), weight) for part, weight in prior.times.items()),
        *(bodies for _ in coarser),
        *(sensors for _ in slower),
    ]
    return Settings(white, floor, tuple(axes), coarser, slower)


def _steps(table: Mapping[float, float], count: int) -> Weighted:
    """By how many values of a table one of several may be above the others, with weights."""
    usual = max(table, key=lambda value: table[value])
    weights = [weight for value, weight in table.items() if value >= usual]
    return tuple(((float(k),), weight / (count if k else 1)) for k, weight in enumerate(weights))


def only(noise: Noise) -> Settings:
    """The grid of a noise without slow noise and process noise."""
    none = (((0.0,), 1.0),)
    return Settings(noise, {}, (*[none] * 5, (((0.0, 0.0), 1.0),), (((1.0,), 1.0),)))


def with_levels(white: Noise, floor: Mapping[str, float], level: float, share: float, slow: float) -> Noise:
    """Reading noise with slow noise and process noise of a size."""
    return replace(
        white,
        slow=tuple(slow * w for w in white.white) if slow else (),
        heat={name: level * value for name, value in floor.items()} if level else None,
        share=share,
    )


def _distance(one: Noise, other: Noise) -> float:
    """Distance of two noise settings in slow noise, form error, unrecorded heat and inputs."""
    slow = sum(abs(a - b) for a, b in zip(_slowness(one), _slowness(other), strict=True))
    form = abs(one.share - other.share) + abs(one.form - other.form) + abs(one.edge - other.edge)
    here, there = (sum((noise.heat or {}).values()) for noise in (one, other))
    heat = abs(here - there) / max(here + there, 1e-300)
    alone = abs(_share_of_one(one) - _share_of_one(other))
    time = abs(log(one.heat_time / other.heat_time))
    return slow + form + alone + heat + time + abs(one.jitter - other.jitter) + abs(one.rough - other.rough)


def _slowness(noise: Noise) -> tuple[float, float]:
    """Slow noise of the least slow output and of the slowest, in reading noises."""
    each = [slow / white for slow, white in zip(noise.slow, noise.white, strict=False)] or [0.0]
    return min(each), max(each)


def _share_of_one(noise: Noise) -> float:
    """Largest share of a state that has one of its own."""
    return max((share for _, share in (noise.force or {}).values()), default=0.0)
