"""A model bound to the grid of a recording."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics.grid import Grid, first_interval
from discovery.dynamics.memory import Memory
from discovery.models import Model, expanded
from discovery.models.model import read_at_start
from discovery.recordings import Campaign
from discovery.terms import Apply, Dual, Expression, Name, Program, Term, compiled, degree, mixed, rewrite
from discovery.terms.dual import Value

Array = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """A model bound to a grid, with index tables made once and its terms compiled once."""

    model: Model  # expanded: no lag() left
    grid: Grid
    states: tuple[str, ...]
    affine: bool  # in its states, with factors that stay what they are within a step
    into: NDArray[np.int64]  # (terms,) index of the state
    source: NDArray[np.int64]  # (terms,) index or -1
    scale: Array  # (states,)
    ends: Memory
    nodes: Memory
    programs: dict[tuple[object, ...], Program] = field(default_factory=dict, repr=False, compare=False)
    lines: dict[tuple[str, ...], bool] = field(default_factory=dict, repr=False, compare=False)

    def __getstate__(self) -> dict[str, object]:
        """What another process gets: it compiles its terms itself, or has them."""
        return {**self.__dict__, "programs": {}}

    def rates(
        self,
        values: Mapping[str, Value],
        wrt: frozenset[str],
        memory: Memory,
        some: tuple[int, ...] | None = None,
    ) -> list[Dual]:
        """Rate of each term, or of some by index, with derivatives by some names."""
        terms = self.model.terms
        taken = terms if some is None else [terms[k] for k in some]
        return self._program("rates", wrt, some, (t.expression for t in taken)).run(values, memory)

    def starts(self, values: Mapping[str, Value], wrt: frozenset[str] = frozenset()) -> dict[str, Dual]:
        """Where each state begins that has a formula for it, with derivatives by some names."""
        told = {name: s.start for name, s in self.model.states.items() if s.start is not None}
        found = self._program("starts", wrt, None, told.values()).run(values)
        return dict(zip(told, found, strict=True))

    def outputs(self, values: Mapping[str, Value], wrt: frozenset[str], memory: Memory) -> list[Dual]:
        """What the model shows of each output of the grid, with derivatives by some names."""
        names = self.grid.outputs
        told = (self.model.outputs.get(name, Name(name)) for name in names)
        return self._program("outputs", wrt, names, told).run(values, memory)

    def _program(
        self, kind: str, wrt: frozenset[str], some: tuple[object, ...] | None, told: Iterable[Expression]
    ) -> Program:
        """The program of some expressions of the model, compiled once."""
        key = kind, wrt, some
        if key not in self.programs:
            self.programs[key] = compiled(tuple(told), wrt)
        return self.programs[key]

    def affine_in(self, states: tuple[str, ...]) -> bool:
        """Whether no term has a curve in some states together, whatever the others are."""
        if states not in self.lines:
            together = frozenset(states)
            self.lines[states] = all(degree(term.expression, together) <= 1 for term in self.model.terms)
        return self.lines[states]

    @cached_property
    def first(self) -> tuple[dict[str, Value], Memory]:
        """Channels at the begin of the first interval, and the memory of it, for what is asked of the first
        instant alone.
        """
        begin: dict[str, Value] = {name: float(series[0]) for name, series in self.grid.ends.items()}
        return begin, Memory(first_interval(self.grid), True)

    @cached_property
    def delays(self) -> tuple[tuple[Term, Apply], ...]:
        """Terms that ask for what a channel was a while ago, each with that."""
        found: list[tuple[Term, Apply]] = []

        def noted(term: Term, apply: Apply) -> None:
            channel = apply.arguments[0]
            if apply.function == "delay" and isinstance(channel, Name) and channel.id in self.grid.samples:
                found.append((term, apply))

        for term in self.model.terms:
            rewrite(term.expression, partial(noted, term))
        return tuple(dict.fromkeys(found))

    def between(self, begin: int, end: int) -> System:
        """The system from one node to another, without readings; what remembers inputs begins there."""
        grid = self.grid.between(begin, end)
        return replace(self, grid=grid, ends=Memory(grid, True), nodes=Memory(grid, False))


def make_system(model: Model, grid: Grid) -> System:
    """Bind a model to a grid."""
    taken = [name for y, name in enumerate(grid.outputs) if grid.measured[:, y].any()]
    model = read_at_start(expanded(model, {*grid.samples, *grid.outputs}), taken)
    states = tuple(model.states)
    index = {name: i for i, name in enumerate(states)}
    variables = frozenset(states)
    moving = frozenset({"time", *(name for name, one in grid.samples.items() if one.linear)})
    return System(
        model=model,
        grid=grid,
        states=states,
        affine=all(
            degree(term.expression, variables) <= 1 and not mixed(term.expression, variables, moving)
            for term in model.terms
        ),
        into=np.array([index[term.into] for term in model.terms], dtype=np.int64),
        source=np.array([index[term.source] if term.source else -1 for term in model.terms], dtype=np.int64),
        scale=np.array([model.states[name].scale for name in states]),
        ends=Memory(grid, True),
        nodes=Memory(grid, False),
    )


def evened(system: System) -> System:
    """The system with long steps divided, which err where a law is not linear: an affine one has none."""
    return system if system.affine else make_system(system.model, system.grid.evened())


def shifted(system: System, offset: Mapping[str, float], late: Mapping[str, float] | None = None) -> System:
    """The system with constants added to channels, and held channels moved in time by `late` seconds.

    Memories and terms read the moved channels.
    """
    grid = system.grid.shifted(offset, late)
    return replace(system, grid=grid, ends=Memory(grid, True), nodes=Memory(grid, False))


def inputs_of(model: Model, campaign: Campaign, outputs: Collection[str]) -> list[str]:
    """Channels that an expanded model reads from a recording, for its terms and start values; no outputs.

    Raises:
        UserError: an output that is no channel.
    """
    shown = {campaign.channels[name].name for name in outputs}
    starting = model.start_names & set(campaign.channels)
    return sorted({*model.inputs, *starting} - shown)


def uncertain(system: System) -> tuple[str, ...]:
    """Channels that the model uses or shows and that are known only within a spread."""
    model = system.model
    used = {*model.inputs, *model.start_names} - {*model.parameters, *model.states}
    return tuple(name for name in system.grid.spread if name in used.union(system.grid.outputs))
