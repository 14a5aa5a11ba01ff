"""The problem of a fit: the unknowns of a model on a set of recordings, and its residual."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import (
    Grid,
    System,
    Trajectory,
    make_grid,
    make_system,
    predict,
    sensitivities,
    simulate,
    start_values,
)
from discovery.dynamics.sensitivity import moved_in_time
from discovery.dynamics.system import evened, inputs_of, shifted, uncertain
from discovery.fitting.noise import Noise
from discovery.models import Model, Parameter, State, expanded
from discovery.models.model import fed_with
from discovery.recordings import Campaign
from discovery.terms import evaluate, names, substitute

Array = NDArray[np.float64]

FORMER = 2  # recordings as which the mean spread of the starts of all bodies counts
MOST = 2.0  # of what is expected, the most that an input is logged late
FARTHEST = 1e6  # times its start that a parameter may go: no recording shows more, and the arithmetic fails
UNREAD = 10.0  # K within which a temperature that nobody reads is what its author believes, without a `prior`

# given, by the noise of what is read, by how far it moves later, or found by the fit
Key = tuple[str, str | None, bool, bool, bool]  # of an unknown: name, recording, and what it is
Spread = Literal["given", "read", "moved", "fitted"]


class Prior(NamedTuple):
    """Prior of a parameter: mean and standard deviation, of its logarithm with `is_log`."""

    mean: float
    sd: float
    is_log: bool = False


@dataclass(frozen=True, slots=True)
class Unknown:
    """One number to find: a parameter (of one recording, or common: ``recording=None``), how far a state
    begins from its declared start, the offset of an input known only within a spread, or the seconds by
    which a held input was logged late.

    A start that is declared by a formula moves with the parameters and inputs in it; the priors of all stay
    independent.
    """

    name: str
    recording: str | None
    is_start: bool
    start: float
    low: float
    high: float
    prior: tuple[float, float] | None = None  # mean and standard deviation
    is_log: bool = False  # ... of its logarithm
    belief: float | None = None  # the start value is believed within a factor exp(belief), with heavy tails
    spread: Spread = "given"  # how the prior of a start is known
    is_offset: bool = False  # `name` is the channel
    is_late: bool = False  # likewise
    is_penalty: bool = False  # the prior is that of the model, and counts once however alike readings are

    @property
    def key(self) -> Key:
        """What distinguishes it from the others."""
        return self.name, self.recording, self.is_start, self.is_offset, self.is_late

    @property
    def is_nuisance(self) -> bool:
        """Whether this is of one recording's circumstances, not of the model."""
        return self.is_start or self.is_offset or self.is_late


@dataclass(frozen=True)
class Problem:
    """A model bound to recordings, with its unknowns in a fixed order."""

    model: Model  # expanded
    systems: tuple[System, ...]
    unknowns: tuple[Unknown, ...]

    @property
    def outputs(self) -> tuple[str, ...]:
        """Channels that are compared."""
        return self.systems[0].grid.outputs

    @property
    def start(self) -> Array:
        """Start values of the unknowns."""
        return np.array([u.start for u in self.unknowns])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the unknowns."""
        return np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])

    def concerns(self, system: System) -> list[int]:
        """Indices of the unknowns that act in a recording."""
        return self._acting.get(system.grid.recording, self._acting[None])

    @cached_property
    def _acting(self) -> dict[str | None, list[int]]:
        """By recording that has unknowns of its own; None: in any other one."""
        own = {None, *(u.recording for u in self.unknowns)}
        return {name: [i for i, u in enumerate(self.unknowns) if u.recording in (None, name)] for name in own}

    def spread(self, noise: Noise, found: Mapping[Key, float] | None = None) -> Problem:
        """The problem with the priors of its start values as a noise has them.

        Args:
            found: spread of each start that is neither read nor given one; default the stated one.
        """
        white = dict(zip(noise.outputs, noise.white, strict=True))
        unknowns = list(self.unknowns)
        for i, u in enumerate(unknowns):
            if u.spread == "read":
                system = next(s for s in self.systems if s.grid.recording == u.recording)
                unknowns[i] = replace(u, prior=(0.0, read_spread(system, u.name, white)))
            elif u.spread in ("moved", "fitted") and found and u.key in found:
                unknowns[i] = replace(u, prior=(0.0, found[u.key]))
        return replace(self, unknowns=tuple(unknowns))

    def among(self, kept: Sequence[int]) -> Problem:
        """The problem with some of its unknowns, in their order; the others stay where they begin."""
        return replace(self, unknowns=tuple(self.unknowns[i] for i in kept))

    def start_spreads(self) -> dict[str, float]:
        """By state: the spread of its starts, where it is neither given nor read; of what a memory holds, the
        largest of a recording.
        """
        own = [u for u in self.unknowns if u.is_start and u.spread in ("moved", "fitted")]
        return {u.name: max(o.prior[1] for o in own if o.name == u.name and o.prior) for u in own}

    def prior_rows(self, theta: Array, together: float = 1.0) -> tuple[Array, Array]:
        """What priors and beliefs add to the least squares: residual (K,) and its derivative (K, U).

        Args:
            together: readings that count as one (`readings_as_one`). A thousand of them in a row that are
                off by what the model lacks must not outvote what is known of a start, an input, or the shape
                of a law: each prior counts as often, but for penalties.
        """
        rows: list[float] = []
        slopes: list[tuple[int, float]] = []
        for i, u in enumerate(self.unknowns):
            if u.prior:
                mean, sd = u.prior
                sd /= 1.0 if u.is_penalty else np.sqrt(together)
                value = np.log(theta[i]) if u.is_log else theta[i]
                rows.append((value - mean) / sd)
                slopes.append((i, 1.0 / (sd * theta[i]) if u.is_log else 1.0 / sd))
            elif u.belief:
                residual, slope = _belief(float(theta[i]), u.start, u.belief)
                rows.append(residual)
                slopes.append((i, slope))
        jacobian = np.zeros((len(rows), len(self.unknowns)))
        for k, (i, slope) in enumerate(slopes):
            jacobian[k, i] = slope
        return np.array(rows), jacobian

    def values(self, system: System, theta: Array) -> dict[str, float]:
        """Parameter values in a recording."""
        out = self.model.values(system.grid.recording)
        for i in self.concerns(system):
            if not self.unknowns[i].is_nuisance:
                out[self.unknowns[i].name] = float(theta[i])
        return out

    def run(self, system: System, theta: Array, near: Trajectory | None = None) -> Trajectory:
        """Free run of a recording with the unknowns at `theta`; `near`: one close by, to begin from."""
        values = self.values(system, theta)
        mine = [(self.unknowns[i], float(theta[i])) for i in self.concerns(system)]
        offset = {u.name: value for u, value in mine if u.is_offset}
        late = {u.name: value for u, value in mine if u.is_late}
        if offset or late:
            system = shifted(system, offset, late)
        start = start_values(system, values, {u.name: value for u, value in mine if u.is_start})
        return simulate(system, values, start, near)

    def residual(self, trajectory: Trajectory) -> Array:
        """Readings minus model (R, Y), NaN where nothing was read."""
        return trajectory.system.grid.readings - predict(trajectory)

    def jacobian(self, trajectory: Trajectory) -> Array:
        """dy/d(unknowns) of a recording, (R, Y, U), zero for unknowns of other recordings."""
        dy = self.slopes(trajectory)
        out = np.zeros((*dy.shape[:2], len(self.unknowns)))
        out[:, :, self.concerns(trajectory.system)] = dy
        return out

    def slopes(self, trajectory: Trajectory) -> Array:
        """dy/d(unknowns that act in a recording), (R, Y, C), in the order of `concerns`."""
        system = trajectory.system
        mine = self.concerns(system)
        late = [i for i in mine if self.unknowns[i].is_late]
        starts = [i for i in mine if self.unknowns[i].is_start]
        # sensitivities() takes the channel of an offset like a parameter
        parameters = [i for i in mine if i not in starts and i not in late]
        dy = sensitivities(
            trajectory,
            [self.unknowns[i].name for i in parameters],
            [self.unknowns[i].name for i in starts],
            moved_in_time(trajectory, [self.unknowns[i].name for i in late]),
            len(late),
        )
        return dy[:, :, np.argsort([*parameters, *starts, *late])]


def make_problem(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str] | None = None,
    grids: Mapping[str, Grid] | None = None,
    priors: Mapping[str, Prior] | None = None,
    belief: Mapping[str, float] | None = None,
) -> Problem:
    """Bind a model to recordings and lay out its unknowns.

    Args:
        outputs: measured channels to compare; default every output of the model that the campaign measures.
        grids: grids made before, by recording (a model with the same inputs may share them).
        priors: by parameter.
        belief: by parameter, the b of a factor exp(b) within which its start value is believed, if it is
            positive, with heavy tails.
    """
    model = expanded(model, campaign.channels)
    if outputs is None:
        outputs = [name for name in (*model.outputs, *model.states) if name in campaign.channels]
    inputs = inputs_of(model, campaign, outputs)
    systems = []
    for recording in recordings:
        grid = grids.get(recording) if grids else None
        if grid is None or not set(inputs) <= set(grid.samples) or grid.outputs != tuple(outputs):
            systems.append(evened(make_system(model, make_grid(campaign, recording, inputs, outputs))))
        else:
            systems.append(make_system(model, grid.shifted({}) if grid.offset or grid.late else grid))
    unknowns = _unknowns(model, systems, recordings, priors or {}, belief or {})
    reach = _memory_ranges(systems, [n for n, c in campaign.channels.items() if c.unit in ("degC", "K")])
    return Problem(model, tuple(systems), tuple(_within(u, reach) for u in unknowns))


def _memory_ranges(systems: Sequence[System], warm: Collection[str]) -> dict[Key, tuple[float, float]]:
    """By start of a memory of recorded inputs: from where to where it may be off. What it holds is a mean of
    what the inputs were before, which is zero or what they are in some recording.

    Args:
        warm: temperatures, which may have been any before a recording.
    """
    found: dict[Key, tuple[float, float]] = {}
    fed = fed_with(systems[0].model)
    for name, followed in fed.items():
        while fed.keys() & names(followed):
            followed = substitute(followed, fed)
        used = names(followed)
        if not used or any(used - s.grid.samples.keys() for s in systems) or used & set(warm):
            continue
        series = [np.ravel(evaluate(followed, s.grid.nodes, memory=s.nodes).value) for s in systems]
        every = np.concatenate([[0.0], *series])
        for system, one in zip(systems, series, strict=True):
            ends = float(every.min() - one[0]), float(every.max() - one[0])
            found[name, system.grid.recording, True, False, False] = ends
    return found


def _within(u: Unknown, reach: Mapping[Key, tuple[float, float]]) -> Unknown:
    low, high = reach.get(u.key, (-np.inf, np.inf))
    return replace(u, low=max(u.low, low), high=min(u.high, high))


def _unknowns(
    model: Model,
    systems: Sequence[System],
    recordings: Sequence[str],
    priors: Mapping[str, Prior],
    belief: Mapping[str, float],
) -> list[Unknown]:
    """Parameters in the order of the model, then starts, offsets and lateness recording by recording."""
    unknowns = []
    for name in model.free:
        p = model.parameters[name]
        if p.per_recording:
            own = (
                [r for r in recordings if r in p.values] if p.values else recordings
            )  # the others keep the common value
            unknowns += [_parameter(name, r, p, priors.get(name), None) for r in own]
        else:
            believed = belief.get(name) if name not in priors and p.value > 0 and p.min >= 0 else None
            unknowns.append(_parameter(name, None, p, priors.get(name), believed))
    for system in systems:
        unknowns += [
            Unknown(state.name, system.grid.recording, True, 0.0, -np.inf, np.inf, (0.0, sd), spread=kind)
            for state in system.model.states.values()
            for sd, kind in [_start_spread(state)]
            if sd > 0
        ]
        unknowns += [
            Unknown(
                n, system.grid.recording, False, 0.0, -np.inf, np.inf, (0.0, sd), spread=how, is_offset=True
            )
            for n in uncertain(system)
            if (sd := system.grid.spread[n])
            for how in _zero_spread(n in system.grid.outputs)
        ]
        unknowns += [
            Unknown(n, system.grid.recording, False, 0.0, -MOST * sd, MOST * sd, (0.0, sd), is_late=True)
            for n, sd in system.grid.unsure.items()
            if n in system.model.inputs
        ]
    return unknowns


def _parameter(
    name: str, recording: str | None, p: Parameter, prior: Prior | None, belief: float | None
) -> Unknown:
    is_log = bool(prior and prior.is_log)
    low = max(p.min, 1e-12) if is_log else p.min
    start = p.at(recording or "")
    known = (prior.mean, prior.sd) if prior else p.prior
    if known is None and p.unit == "degC":
        known = start, UNREAD
    reach = FARTHEST * abs(start) or np.inf
    low, high = max(low, -reach), min(p.max, reach)
    penalty = prior is None and p.prior is not None
    return Unknown(name, recording, False, start, low, high, known, is_log, belief, is_penalty=penalty)


def _zero_spread(is_output: bool) -> list[Spread]:
    """How the spread of an offset is known: that of an output's zeros is at most the stated one."""
    return ["fitted"] if is_output else ["given"]


def _start_spread(state: State) -> tuple[float, Spread]:
    """Standard deviation of a start before anything is known of noise and size, and how it is known."""
    if state.start_sd is not None:
        return state.start_sd, "given"
    if state.memory:
        return 1.0, "moved"
    return 1.0, "read" if state.read_as else "fitted"


def read_spread(system: System, state: str, white: Mapping[str, float]) -> float:
    """Standard deviation of a start that is read: the reading noise, and the change of the state up to the
    first reading.
    """
    output = system.model.states[state].read_as
    series = system.grid.readings[:, system.grid.outputs.index(output)]
    seen = np.flatnonzero(np.isfinite(series))
    time = system.grid.time[system.grid.read]
    late = float(time[seen[0]] - system.grid.time[0])
    if late > 0 and len(seen) > 1:
        late *= abs(float(series[seen[1]] - series[seen[0]])) / float(time[seen[1]] - time[seen[0]])
    return float(np.hypot(white[output], late if len(seen) > 1 else 0.0))


def _belief(value: float, start: float, width: float) -> tuple[float, float]:
    """Residual and slope of a heavy-tailed (Student, 4 degrees of freedom) belief in the logarithm of a
    parameter.

    A third of the start value is added to both, so that a parameter may go to zero.
    """
    shift = start / 3
    u = float(np.log((max(value, 0.0) + shift) / (start + shift))) / width
    freedom = 4.0
    residual = float(np.sign(u) * np.sqrt((freedom + 1) * np.log1p(u * u / freedom)))
    flat = float(np.sqrt((freedom + 1) / freedom))
    outer = (freedom + 1) * u / (freedom + u * u) / residual if abs(u) > 1e-6 else flat
    return residual, outer / (width * (max(value, 0.0) + shift))
