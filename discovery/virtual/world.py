"""A drawn machine with its recordings, and what a refit of its baseline can and cannot absorb of a change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from discovery.virtual.log import Chain, Columns, observe, reading_instants
from discovery.virtual.machine import Lack, Machine
from discovery.virtual.masses import hidden_masses
from discovery.virtual.network import Array, Inputs, heat
from discovery.virtual.refit import Refit, refit
from discovery.virtual.signals import HOUR, Draw, noise
from discovery.virtual.simulate import Run, simulate

RECORDINGS = ("a", "b", "c")
FIT = ("a", "b")  # recordings to fit; the last is held out
LUMPING = (
    0.2,
    0.6,
)  # rms over noise that a baseline leaves of its machine without effect; the noise is set by it
TRIES = 8
MASS = "second_thermal_mass"
APART = 3.0  # log evidence within which readings do not tell two models apart

Known = tuple[str, tuple[str, ...], float]  # effect, states, rms over noise


@dataclass(frozen=True)
class World:
    """A machine, the inputs of its recordings and the noise of a reading."""

    machine: Machine
    inputs: dict[str, Inputs]
    instants: dict[str, Array]  # s, of the readings
    origins: dict[str, str] | None  # ISO 8601 instants of time 0, where the log has a calendar
    noise: float  # of a reading, times the `sd` of its channel
    coloured: bool
    seed: int  # of the noise
    lumping: float  # rms over noise that the baseline leaves of the machine in silence
    fitted: Refit  # the baseline on readings without noise and without effect

    @property
    def sigma(self) -> Array:
        """Noise of a reading of each output, (Y,)."""
        return sigma_of(self.machine, self.noise)

    def runs(self, machine: Machine, recordings: tuple[str, ...] = RECORDINGS) -> dict[str, Run]:
        """What a machine does over the recordings."""
        return {r: _run(machine, self.inputs[r]) for r in recordings}

    def logs(
        self, machine: Machine, recordings: tuple[str, ...] = RECORDINGS, *, noisy: bool = False
    ) -> dict[str, Columns]:
        """Logs of a machine, its readings with or without noise."""
        chain = Chain(self.noise, 0.3 if self.coloured else 0.0, machine.pace.hours * 3600.0 / 36.0)
        return {
            r: observe(machine, run, first_step(machine), self.instants[r],
            np.random.default_rng([self.seed, k]),
                       chain if noisy else None)
            for k, (r, run) in enumerate(self.runs(machine, recordings).items())
        }  # fmt: skip

    def change(self, machine: Machine) -> Array:
        """Change (R,) of what the baseline leaves, over noise, when the machine of this world is this one.

        The baseline runs on the inputs that this machine shows: a chiller that switches at other times, or a
        warmer sump, stands in the log.
        """
        return self.left - self.fitted.on(machine, self.logs(machine, FIT))

    @cached_property
    def left(self) -> Array:
        """What the fitted baseline leaves (R,) of the machine of this world, over noise.

        It is the residual of the fit, unless something is concealed in this machine already.
        """
        return self.fitted.on(self.machine, self.logs(self.machine, FIT))

    def size(self, machine: Machine) -> float:
        """Rms over noise that the first step of a refit leaves of a change."""
        return float(np.sqrt(np.mean(self.fitted.left(self.change(machine)) ** 2)))

    @cached_property
    def lacks(self) -> list[Known]:
        """Effects that the baseline lacks in silence, each with its states and the rms over noise that a
        refit leaves of it: the laws of the plant, and bodies where the insides of others show as well.

        Laws of one kind stand there together, too: five exchanges with the air can show where none of them
        shows alone. Only what the readings can tell: N readings hold at most N rms^2/2 of log evidence.
        """
        kinds: dict[str, list[Lack]] = {}
        for lack in self.machine.lacks:
            kinds.setdefault(lack.effect, []).append(lack)
        groups = [[lack] for lack in self.machine.lacks]
        groups += [group for effect, group in kinds.items() if len(group) > 1 and effect != MASS]
        laws = [self._known(group) for group in groups]
        hidden = hidden_masses(self.machine, self.fitted, self.logs(self.machine, FIT))
        known = {states for effect, states, _ in laws if effect == MASS}
        others = [(MASS, (body,), rms) for body, rms in hidden.items() if (body,) not in known]
        every = [*laws, *others]
        return [one for one in every if len(self.fitted.residual) * one[2] ** 2 / 2.0 > APART]

    def _known(self, group: list[Lack]) -> Known:
        """Laws of one kind, all bodies where they act, and what a refit leaves of all of them."""
        believed = reduce(Machine.as_believed, group, self.machine)
        states = tuple(dict.fromkeys(state for lack in group for state in lack.states))
        return group[0].effect, states, self.size(believed)

    def visible(self, logs: dict[str, Columns]) -> float:
        """Rms over noise by which the residual of a full refit differs with an effect and without it."""
        found = refit(self.machine, {r: logs[r] for r in FIT}, self.sigma, self.fitted)
        with_it, without = found.residual, self.fitted.residual
        if len(with_it) != len(without):  # readings were moved in time
            return float(np.sqrt(max(0.0, found.rms**2 - self.fitted.rms**2)))
        return float(np.sqrt(np.mean((with_it - without) ** 2)))


def draw_world(rng: Draw, family: Callable[[Draw], Machine], *, coloured: bool) -> World:
    """A machine whose baseline misfits by a share of the noise, with its recordings.

    The noise is drawn; where the misfit is too large for it, more noise, else another machine.

    Raises:
        RuntimeError: no machine of TRIES fits, which is a mistake in the family.
    """
    for _ in range(TRIES):
        machine = family(rng)
        if coloured:
            machine = machine.plus(
                [
                    heat("unrecorded", node, share, f"unrecorded {body}")
                    for body, bar in machine.bodies.items()
                    for node, share in bar.span()
                ]
            )
        origins, ages = draw_calendar(rng)
        inputs = {r: draw_inputs(rng, machine, k, ages[k]) for k, r in enumerate(RECORDINGS)}
        gaps = draw_gaps(rng, *machine.pace.read_s)
        instants = {r: reading_instants(rng, machine.pace, gaps) for r in RECORDINGS}
        low, high = machine.pace.noise
        seed = int(rng.integers(2**31))
        quiet = {
            r: {k: np.zeros_like(v) if k.startswith("unrecorded") else v for k, v in u.items()}
            for r, u in inputs.items()
        }
        blank = World(machine, quiet, instants, origins, low, coloured, seed, 0.0, None)  # type: ignore[arg-type]
        found = refit(machine, blank.logs(machine, FIT), sigma_of(machine, low))
        level = round(max(low, low * found.rms / rng.uniform(*LUMPING)), 3)
        if level > high:
            continue
        world = replace(blank, inputs=inputs, noise=level, lumping=found.rms * low / level)
        return replace(world, fitted=refit(machine, world.logs(machine, FIT), world.sigma, found))
    raise RuntimeError(f"no machine of {TRIES} has a baseline that fits it well enough")


def draw_gaps(rng: Draw, low: float, high: float) -> tuple[float, float]:
    """Smallest and largest gap [s] between readings: all alike, or irregular."""
    gap = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    return (gap, gap) if rng.uniform() < 0.5 else (max(low, 0.75 * gap), min(high, 1.35 * gap))


def sigma_of(machine: Machine, level: float) -> Array:
    """Noise of a reading of each output at a noise level."""
    return level * np.array([c.sd for c in machine.channels if c.series is None])


def first_step(machine: Machine) -> int:
    """The step at which the recording begins."""
    return round(machine.pace.before_h * HOUR / machine.pace.step_s)


def draw_inputs(rng: Draw, machine: Machine, number: int, age: float) -> Inputs:
    """Inputs of a recording and of the hours before it; the machine rests for a part of these.

    Adds `clock` [s since the recording began], `number` and `age` of the recording, and the heat that no
    channel shows at each body, `unrecorded ...`.
    """
    pace = machine.pace
    u = dict(machine.cycle(rng, pace.hours + pace.before_h))
    n, first = len(next(iter(u.values()))), first_step(machine)
    rest = rng.uniform(0.05, 0.45) * pace.before_h
    idle = slice(max(0, first - round(rest * HOUR / pace.step_s)), first)
    for name in machine.work:
        u[name] = u[name].copy()
        u[name][idle] = 0.0
    u["clock"] = np.asarray((np.arange(n) - first + 0.5) * pace.step_s)
    u |= {"number": np.full(n, float(number)), "age": np.full(n, age)}
    tau = pace.hours * HOUR / 24.0
    return u | {f"unrecorded {b}": noise(rng, n, pace.step_s, tau, pace.heat_w) for b in machine.bodies}


def draw_calendar(rng: Draw) -> tuple[dict[str, str] | None, tuple[float, ...]]:
    """Dates of the recordings, or none, and their ages: 0, 1, ... or in proportion to the dates."""
    days = np.cumsum([rng.integers(0, 300), rng.integers(5, 20), rng.integers(5, 25)])
    begin = np.datetime64("2024-01-08T00:00:00") + days.astype("timedelta64[D]")
    at = [str(d + np.timedelta64(int(rng.integers(0, 86400)), "s")) for d in begin]
    if rng.uniform() < 0.5:
        return None, (0.0, 1.0, 2.0)
    return dict(zip(RECORDINGS, at, strict=True)), (
        0.0,
        1.0,
        float((days[2] - days[0]) / (days[1] - days[0])),
    )


def _run(machine: Machine, inputs: Inputs) -> Run:
    return simulate(machine.network, inputs, machine.pace.step_s, float(inputs[machine.words.air][0]))
