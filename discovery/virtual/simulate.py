"""Running a network: names into tables once, then the kernel; what came out, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from discovery.virtual import kernel
from discovery.virtual.network import LEVEL, ZERO, Array, Inputs, Law, Network, gate_values

Ints = kernel.Ints
TOLERANCE_K, LEVEL_TOLERANCE = 0.1, 0.01


@dataclass(frozen=True)
class Run:
    """What a network did over n steps of `step_s`: nodes at n + 1 instants, inputs and flows over n steps."""

    network: Network
    step_s: float
    inputs: Inputs
    nodes: Array  # (n + 1, N)
    switches: Array  # (n + 1, S)
    tables: Tables

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self.nodes) - 1

    def __getitem__(self, name: str) -> Array:
        """A node at the beginning of each step or an input over it, (n,)."""
        if name in self.network.nodes:
            return self.nodes[:-1, list(self.network.nodes).index(name)]
        return self.inputs[name]

    def flow(self, chosen: str | Callable[[Law], bool]) -> Array:
        """Sum of the flows (n,) of the laws of a name, or of those that `chosen` picks, as steps begin."""
        pick = (lambda law: law.name == chosen) if isinstance(chosen, str) else chosen
        rows = [r for r, law in enumerate(self.network.laws) if pick(law)]
        t = self.tables
        found = kernel.flows(self.nodes, self.switches, t.where[rows], t.number[rows], t.gates, t.outside)
        return np.asarray(found.sum(axis=1))

    @cached_property
    def end(self) -> State:
        """Where it stopped: the start of what comes next."""
        return State(
            dict(zip(self.network.nodes, self.nodes[-1].tolist(), strict=True)),
            dict(zip(self.network.switches, self.switches[-1].tolist(), strict=True)),
        )


@dataclass(frozen=True)
class State:
    """Nodes and switches at an instant; what is not named starts at `default`, levels empty, switches off."""

    nodes: Mapping[str, float]
    switches: Mapping[str, float]
    default: float = 22.0


@dataclass(frozen=True)
class Tables:
    """A network bound to inputs, as the kernel reads it."""

    where: Ints
    number: Array
    gates: Array
    outside: Array


def simulate(network: Network, inputs: Inputs, step_s: float, start: State | float) -> Run:
    """Run `network` over all steps of `inputs`.

    Args:
        start: nodes and switches at the beginning; a number: every node at this temperature, or rather value.

    Raises:
        KeyError: a law or switch names something that is neither node nor input.
        RuntimeError: the plant runs away.
    """
    state = State({}, {}, start) if isinstance(start, float | int) else start
    n = len(next(iter(inputs.values())))
    tables, index = _tables(network, inputs, n)
    at = [index[s.sensor] for s in network.switches.values()]
    target = [
        gate_values(s.target, inputs, n) if isinstance(s.target, str) else np.full(n, s.target)
        for s in network.switches.values()
    ]
    capacity = np.array(list(network.nodes.values()), dtype=np.float64)
    nodes, switches = kernel.march(
        np.array(
            [
                state.nodes.get(name, 0.0 if C == LEVEL else state.default)
                for name, C in network.nodes.items()
            ],
            dtype=np.float64,
        ),
        np.array([state.switches.get(name, 0.0) for name in network.switches], dtype=np.float64),
        step_s,
        capacity,
        np.where(capacity == LEVEL, LEVEL_TOLERANCE, TOLERANCE_K),
        tables.where,
        tables.number,
        tables.gates,
        tables.outside,
        np.array(at, dtype=np.int64),
        np.ascontiguousarray(np.array(target).reshape(-1, n).T),
        np.array([-s.band if s.heats else s.band for s in network.switches.values()], dtype=np.float64),
        *elimination(len(network.nodes), tables.where),
    )
    if not np.isfinite(nodes[-1]).all():
        raise RuntimeError("the plant ran away: a law is far faster than the step")
    return Run(network, step_s, inputs, nodes, switches, tables)


def _tables(network: Network, inputs: Inputs, n: int) -> tuple[Tables, dict[str, int]]:
    """Tables of the laws, and the index of every name."""
    names = list(network.nodes)
    used = {name for law in network.laws for name in (law.source, law.into)} - set(names) - {ZERO}
    used |= {s.sensor for s in network.switches.values()} - set(names)
    outside = [ZERO, *sorted(used)]
    index = {name: k for k, name in enumerate([*names, *outside])}
    switch = {name: k for k, name in enumerate(network.switches)}
    gates = {None: 0} | {
        gate: k for k, gate in enumerate(dict.fromkeys(x.gate for x in network.laws if x.gate), 1)
    }
    where = np.array(
        [
            (
                law.form,
                index[law.into],
                index[law.source],
                index.get(law.leaves, -1),
                index[law.film[0]] if law.film else -1,
                switch[law.switch] if law.switch else -1,
                gates[law.gate],
            )
            for law in network.laws
        ],
        dtype=np.int64,
    ).reshape(-1, 7)
    number = np.zeros((len(network.laws), kernel.SHAPE + 5))
    for row, law in zip(number, network.laws, strict=True):
        row[: kernel.SHAPE] = law.size, law.take, law.film[1] if law.film else 1.0
        row[kernel.SHAPE : kernel.SHAPE + len(law.shape)] = law.shape
    factors = np.column_stack([gate_values(gate, inputs, n) for gate in gates])
    series = np.column_stack([np.zeros(n), *(inputs[name] for name in outside[1:])])
    return Tables(where, number, factors, series), index


def elimination(N: int, where: Ints) -> tuple[Ints, Ints, Ints]:
    """Order of elimination by least degree, and the neighbours still there at each: order, start, later."""
    around: list[set[int]] = [set() for _ in range(N)]
    for row in where:
        ends = {
            int(row[c]) for c in (kernel.INTO, kernel.SOURCE, kernel.LEAVES, kernel.FILM) if 0 <= row[c] < N
        }
        for i in ends:
            around[i] |= ends - {i}
    left, order, later, start = set(range(N)), list[int](), list[int](), [0]
    while left:
        p = min(left, key=lambda i: (len(around[i]), i))
        left.remove(p)
        order.append(p)
        later += sorted(around[p])
        start.append(len(later))
        for i in around[p]:
            around[i] = (around[i] | around[p]) - {i, p}
    return tuple(np.array(x, dtype=np.int64) for x in (order, start, later))  # type: ignore[return-value]
