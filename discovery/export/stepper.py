"""The Python reference of every target: one fixed step after the other, inputs held.

An explicit member of the family of `discovery.dynamics.kernel`: the exponential Rosenbrock-Euler step
(Hochbruck & Ostermann, Acta Numerica 19, 2010, section 2.4)

    x(t + h) = x + h phi1(h A) f(x, u),    A = df/dx,    phi1(z) = (e^z - 1)/z,

exact for terms linear in x under held inputs however stiff they are, of second order otherwise. `h phi1(hA)
f` is the solution of z' = A z + f, z(0) = 0 at h. It is taken in sub-steps for which the norm of A is at most
1/2, each by a Taylor series of 12 terms that needs products of A with a vector alone: no matrix is inverted,
no memory allocated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export import kernel
from discovery.export.compiled import Compiled
from discovery.export.program import Program

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Table = tuple[NDArray[np.int64], Array, NDArray[np.int64]]

INTEGRATOR = (
    "Inputs u are held over the step of h = step_s seconds; outputs are valid at its end.",
    "1. delays: an input d = (whole + part) h seconds ago is (1 - part) u[k - whole] + part u[k - whole - "
    "1]; before the start it was u[0].",
    "2. f_i = scale_i (sum of the terms into i - sum of the terms from i) at (x, u, time = k h); "
    "A_ij = df_i/dx_j, exact; comparisons and sign() have no slope, max and min that of the argument taken; "
    "a play has slope 1 in contact, else 0.",
    "3. play(e, w): p = max(e - |w|, min(e + |w|, p)), evaluated at the beginning of the step and again at "
    "its end; at the start p = e.",
    "4. s = smallest count of sub-steps for which (largest absolute row sum of A) h/s "
    "<= 1/2; tau = h/s; z = 0.",
    "5. s times: v = tau (A z + f), z = z + v; for j = 2 ... 12: v = (tau/j) A v, z = z + v.",
    "6. x = x + z by compensated summation: i = z - c, n = x + i, c = (n - x) - i, x = n.",
    "7. y = outputs(x, u, time = (k + 1) h). If a state or output is not finite or not below 1e30, or s "
    "would be 4096 or more, "
    "the step fails and nothing changes.",
)


@dataclass(frozen=True)
class Snapshot:
    """Everything that a running model remembers."""

    x: Array
    carry: Array
    delayed: Array
    plays: Array
    ring: Array
    position: Ints
    count: int


class Stepper:
    """A running model: `start` it with the first inputs, then `step` it with the inputs of each tick."""

    def __init__(self, compiled: Compiled, tables: _Tables | None = None) -> None:
        self.compiled = compiled
        self._tables = tables or _Tables(compiled)
        n, delays = len(compiled.states), len(compiled.delays)
        self.x, self.carry = np.zeros(n), np.zeros(n)
        self.delayed, self.plays = np.zeros(delays), np.zeros(compiled.plays)
        self.ring = np.zeros(int(self._tables.delays[:, 2].sum()))
        self.position = np.zeros(delays, dtype=np.int64)
        self.count = 0

    def start(self, u: Array) -> None:
        """Set the start state for inputs u (U,).

        Raises:
            UserError: a start value that is not finite.
        """
        u, empty = np.asarray(u, dtype=float), np.zeros(0)
        values = _run(self._tables.start, u, empty, empty, empty)
        if not np.isfinite(values).all():
            raise UserError(
                f"model '{self.compiled.name}' has no finite start for these inputs; "
                "check that all are measured"
            )
        n = len(self.compiled.states)
        self.x[:], self.carry[:], self.plays[:] = values[:n], 0.0, values[n:]
        for k, delay in enumerate(self.compiled.delays):
            offset, length = self._tables.delays[k, 1:]
            self.ring[offset : offset + length] = u[delay.input]
            self.delayed[k] = u[delay.input]
        self.position[:] = 0
        self.count = 0

    def twin(self) -> Stepper:
        """Another one in the same state, of the same parameters from now on."""
        found = Stepper(self.compiled, self._tables)
        found.restore(self.snapshot())
        return found

    def retune(self, values: Mapping[str, float]) -> None:
        """Move parameters; delays keep their length."""
        for k, (name, _) in enumerate(self.compiled.parameters):
            if name in values:
                self._tables.retune(k, values[name])

    def outputs(self, u: Array) -> Array:
        """Outputs (Y,) of the present state under inputs u (U,), without a step."""
        time = self.count * self.compiled.step_s
        values = _run(
            self._tables.outputs, np.asarray(u, dtype=float), self.x, self.delayed, self.plays, time
        )
        return values[: len(self.compiled.outputs)]

    def rates(self, u: Array) -> Array:
        """dx/dt (n,) of the present state under inputs u (U,) [per s]."""
        time = self.count * self.compiled.step_s
        values = _run(self._tables.rates, np.asarray(u, dtype=float), self.x, self.delayed, self.plays, time)
        return values[: len(self.compiled.states)]

    def jacobian(self, u: Array) -> Array:
        """Slopes (n, n) of the rates in the states, at the present state under inputs u (U,) [per s]."""
        time, n = self.count * self.compiled.step_s, len(self.compiled.states)
        values = _run(self._tables.rates, np.asarray(u, dtype=float), self.x, self.delayed, self.plays, time)
        found = np.zeros((n, n))
        found[self._tables.row, self._tables.column] = values[n : n + len(self._tables.row)]
        return found

    def step(self, u: Array) -> Array | None:
        """Outputs (Y,) after one step under inputs u (U,); None, and no change, where the step fails."""
        y = self.run(np.asarray(u, dtype=float)[None, :])
        return y[0] if len(y) else None

    def run(self, u: Array) -> Array:
        """Outputs (K, Y) after each of the steps under inputs u (K, U); fewer rows where a step fails."""
        u = np.ascontiguousarray(u, dtype=float)
        y = np.empty((len(u), len(self.compiled.outputs)))
        t = self._tables
        done = kernel.advance(
            t.rates, t.outputs, t.row, t.column, t.delays, t.part, self.compiled.step_s, u, self.x,
            self.carry, self.delayed, self.plays, self.ring, self.position, self.count, y,
        )  # fmt: skip
        self.count += int(done)
        return y[:done]

    def snapshot(self) -> Snapshot:
        """A copy of the running state."""
        return Snapshot(
            self.x.copy(),
            self.carry.copy(),
            self.delayed.copy(),
            self.plays.copy(),
            self.ring.copy(),
            self.position.copy(),
            self.count,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot.

        Raises:
            UserError: a snapshot of another model.
        """
        pairs = [
            (self.x, snapshot.x), (self.carry, snapshot.carry), (self.delayed, snapshot.delayed),
            (self.plays, snapshot.plays), (self.ring, snapshot.ring), (self.position, snapshot.position),
        ]  # fmt: skip
        if any(mine.shape != theirs.shape for mine, theirs in pairs):
            raise UserError(
                f"the saved state does not fit model '{self.compiled.name}'; it is of another model"
            )
        for mine, theirs in pairs:
            mine[...] = theirs
        self.count = snapshot.count


def free_run(compiled: Compiled, inputs: Array) -> Array:
    """Outputs (K, Y) under inputs (K, U) from the start; fewer where a step is not finite."""
    stepper = Stepper(compiled)
    stepper.start(inputs[0])
    return stepper.run(inputs)


class _Tables:
    """The programs of a model as arrays for the kernel."""

    def __init__(self, compiled: Compiled) -> None:
        values = [value for _, value in compiled.parameters]
        self.start = _table(compiled.start, values)
        self.rates = _table(compiled.rates, values)
        self.outputs = _table(compiled.results, values)
        self.row = np.array([i for i, _ in compiled.nonzeros], dtype=np.int64)
        self.column = np.array([j for _, j in compiled.nonzeros], dtype=np.int64)
        delays = compiled.delays
        columns = [[d.input for d in delays], compiled.offsets, [d.length for d in delays]]
        self.delays = np.array(columns, dtype=np.int64).reshape(3, -1).T.copy()
        self.part = np.array([delay.part for delay in delays])
        self.programs = (compiled.start, compiled.rates, compiled.results)

    def retune(self, parameter: int, value: float) -> None:
        """Move the parameter of this number."""
        for program, table in zip(self.programs, (self.start, self.rates, self.outputs), strict=True):
            for k, i in enumerate(program.instructions):
                if i.operation == "parameter" and i.index == parameter:
                    table[1][k] = value


def _table(program: Program, parameters: Sequence[float]) -> Table:
    """A program for the kernel, which knows parameters as constants."""
    rows, values = [], []
    for i in program.instructions:
        given = i.operation == "parameter"
        code = kernel.CODE["constant" if given else i.operation]
        rows.append((code, *(*i.arguments, 0, 0, 0)[:3], i.index))
        values.append(parameters[i.index] if given else i.value)
    table = np.array(rows, dtype=np.int64).reshape(-1, 5)
    return table, np.array(values, dtype=float), np.array(program.results, dtype=np.int64)


def _run(table: Table, u: Array, x: Array, d: Array, p: Array, time: float = 0.0) -> Array:
    numbers = np.empty(len(table[0]))
    kernel.run(table[0], table[1], numbers, u, x, d, p, time)
    return np.asarray(numbers[table[2]])
