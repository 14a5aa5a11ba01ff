"""A drawn machine with three recordings, and what a refit of its lumped baseline can and cannot absorb.

A refit is judged by projection: the baseline's sensitivities (finite differences of the lumped plant) explain
what they can of a change of the readings, the rest is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.virtual.chains import Law, Propagator, propagator, run
from discovery.virtual.cycles import HOUR, noise
from discovery.virtual.fine import (
    BODIES,
    STEP_S,
    T_REF,
    Array,
    FineMachine,
    Inputs,
    draw_inputs,
    draw_machine,
    lumped,
)

RECORDINGS = ("a", "b", "c")
FIT = (0, 1)  # recordings to fit; the last is held out
READ_EVERY = round(600.0 / STEP_S)  # steps between readings
LUMPING = 0.25  # largest rms over noise that the cutting into nodes may leave after a refit


@dataclass(frozen=True)
class World:
    """A machine and its three recordings. Readings are stacked: recordings, instants, four outputs."""

    plant: Propagator
    inputs: tuple[Inputs, ...]
    starts: tuple[Array, ...]  # (5,) degC
    heat: tuple[Array, ...]  # (n, 5) W, everyday
    noise: float  # um
    columns: (
        Array  # (3 R 4, P): what a refit can move, readings for a relative change or for 1 K of a start value
    )
    of_c: NDArray[np.bool_]  # (P,): start values of `c`, which a fit of `a` and `b` does not touch

    @property
    def seen(self) -> int:
        """Number of values to fit; the rest is held out."""
        return len(self.columns) * len(FIT) // len(RECORDINGS)

    def readings(self, laws: Sequence[Sequence[Law]] | None = None) -> Array:
        """(3 R 4,) noise-free readings, with laws for each recording."""
        return self.shown(self.bodies(laws))

    def bodies(self, laws: Sequence[Sequence[Law]] | None = None) -> list[Array]:
        """Body means of the three recordings, (n + 1, 5) each."""
        each = laws or ((),) * len(RECORDINGS)
        return [run(self.plant, *x) for x in zip(self.inputs, self.starts, self.heat, each, strict=True)]

    def shown(self, bodies: Sequence[Array]) -> Array:
        """(3 R 4,) readings of body means."""
        return _stack(bodies, self.plant.machine)

    def left(self, change: Array) -> Array:
        """What a refit on `a` and `b` leaves of a change (3 R 4,); `c` has its own start values refitted."""
        n, common, own = self.seen, self.columns[:, ~self.of_c], self.columns[:, self.of_c]
        rest = change - common @ np.linalg.lstsq(common[:n], change[:n], rcond=1e-9)[0]
        return np.asarray(rest - own @ np.linalg.lstsq(own[n:], rest[n:], rcond=1e-9)[0])

    def size_of(self, change: Array) -> float:
        """Rms that a refit leaves of a change on the recordings to fit, over noise."""
        return float(np.sqrt(np.mean(self.left(change)[: self.seen] ** 2))) / self.noise


def draw_world(rng: np.random.Generator, *, coloured: bool) -> World:
    """A machine, stiff enough inside that its lumped baseline fits it well below noise, and three cycles.

    coloured: small unmodelled heat (2 W, 3 h) at every body.
    """
    sigma = round(float(rng.uniform(0.3, 0.7)), 2)
    machine = replace(draw_machine(rng), stiffness=float(rng.uniform(0.4, 2.5)))
    inputs = tuple(draw_inputs(rng, machine) for _ in RECORDINGS)
    starts = tuple(np.asarray(u.air[0] + rng.normal(0.0, 0.25, 5)) for u in inputs)
    n, sd = len(inputs[0].air), 2.0 if coloured else 0.0
    heat = tuple(np.column_stack([noise(rng, n, STEP_S, 3 * HOUR, sd) for _ in BODIES]) for _ in RECORDINGS)
    columns, of_c = sensitivities(machine, inputs, starts)
    world = World(propagator(machine), inputs, starts, heat, sigma, columns, of_c)
    while (too_much := lumping(world) / LUMPING) > 1.0:  # the rms falls as one over the stiffness
        machine = replace(machine, stiffness=machine.stiffness * too_much * 1.05)
        world = replace(world, plant=propagator(machine))
    return world


def lumping(world: World) -> float:
    """Rms over noise that the cutting into nodes leaves after a refit of the lumped baseline."""
    quiet = replace(world, heat=tuple(np.zeros_like(h) for h in world.heat))
    coarse = replace(quiet, plant=propagator(lumped(world.plant.machine)))
    return world.size_of(quiet.readings() - coarse.readings())


def sensitivities(
    machine: FineMachine, inputs: Sequence[Inputs], starts: Sequence[Array]
) -> tuple[Array, NDArray[np.bool_]]:
    """Columns (3 R 4, P) of every free number of the baseline, and which are start values of `c`."""
    coarse, step = lumped(machine), 1e-3
    quiet = np.zeros((len(inputs[0].air), 5))

    def readings(m: FineMachine) -> Array:
        p = propagator(m)
        return _stack([run(p, u, s, quiet) for u, s in zip(inputs, starts, strict=True)], m)

    base, columns = readings(coarse), []
    for name in ("links", "air", "loss", "wet"):
        values = getattr(coarse, name)
        for i in range(len(values)):
            changed = values * np.where(np.arange(len(values)) == i, 1 + step, 1.0)
            columns.append((readings(replace(coarse, **{name: changed})) - base) / step)
    columns.append((readings(replace(coarse, cooling=coarse.cooling * (1 + step))) - base) / step)
    p, one_k = propagator(coarse), np.eye(5)
    still = _only_pumping(inputs)
    for k, u in enumerate(still):
        for i in range(5):
            alone = [
                run(p, u, one_k[i], quiet) + T_REF if j == k else _nothing(u) for j in range(len(inputs))
            ]
            columns.append(_stack(alone, coarse))
    of_c = np.arange(len(columns)) >= len(columns) - 5
    return np.column_stack(columns), of_c


def _only_pumping(inputs: Sequence[Inputs]) -> list[Inputs]:
    """The same pumping with nothing else: the answer to a start value alone."""
    none = np.zeros_like(inputs[0].air)
    return [Inputs(none, none, u.pump, none, none, none) for u in inputs]


def _nothing(u: Inputs) -> Array:
    """Body means of a recording in which nothing happens."""
    return np.full((len(u.air) + 1, 5), T_REF)


def _stack(bodies: Sequence[Array], m: FineMachine) -> Array:
    return np.concatenate([((b[::READ_EVERY] - T_REF) @ m.outputs.T).ravel() for b in bodies])
