"""Hidden thermal masses: each error is a sum of a few of them, each driven by a sparse sum of inputs.

    ds_j/dt = sum_k g_jk phi_k(u) - (a_j + b_j pump) s_j          E = sum_j s_j + offset

Eq. (8) generalised: there every input has one mass of its own, in eq. (9) all inputs share one. `b_j` lets a
mass answer quicker while cutting fluid runs over it, which no constant time constant can. On a grid of (dry,
wet) time constants the model is linear in its gains, so the filtered inputs are the columns of a regression
in the *outputs*: readings are used where they were taken and nothing is differentiated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Grid, make_system, sensitivities, simulate
from discovery.models import Model, Parameter, State
from discovery.sparse.drives import AMBIENT, Inputs, mass_drives
from discovery.sparse.gram import Gram, gram, project_out, total
from discovery.terms import Expression, Number, Term, evaluate, names, parse, text

Array = NDArray[np.float64]

HOUR = 3600.0
_CHUNK = 8  # masses simulated at once: bounds the memory of fine grids
_QUICKEST = 200.0  # s


@dataclass(frozen=True)
class Mass:
    """A point of the grid: time constants [s] without and with cutting fluid."""

    dry: float
    wet: float

    @property
    def rates(self) -> tuple[float, float]:
        """a and b in 1/h."""
        return HOUR / self.dry, HOUR / self.wet - HOUR / self.dry


@dataclass(frozen=True)
class MassLibrary:
    """Every drive into every mass: column k is `drive[k]` into `mass[k]`, column 0 the offset."""

    masses: tuple[Mass, ...]
    drives: tuple[Expression, ...]
    gate: Expression
    soaked: tuple[bool, ...]  # drives whose mass begins in balance with them: air, measured bodies

    @property
    def drive(self) -> NDArray[np.intp]:
        """(M,) drive of each column, -1 for the offset."""
        return np.concatenate([[-1], np.repeat(np.arange(len(self.drives)), len(self.masses))])

    @property
    def mass(self) -> NDArray[np.intp]:
        """(M,) mass of each column, -1 for the offset."""
        return np.concatenate([[-1], np.tile(np.arange(len(self.masses)), len(self.drives))])

    @property
    def labels(self) -> list[str]:
        """What reports call the columns."""
        out = ["1"]
        for drive, mass in zip(self.drive[1:], self.mass[1:], strict=True):
            m = self.masses[mass]
            wet = f"/{m.wet:g}" if m.wet != m.dry else ""
            out.append(f"{text(self.drives[drive])} through {m.dry:g}{wet} s")
        return out


def make_mass_library(
    inputs: Inputs, time_constants: Sequence[float], ratios: Sequence[float], extra: Sequence[str] = ()
) -> MassLibrary:
    """Library over a grid; without a switching pump every ratio is 1."""
    masses = [
        Mass(tau, tau / ratio)
        for tau in time_constants
        for ratio in (ratios if inputs.gate else (1.0,))
        if ratio == 1.0 or tau / ratio >= _QUICKEST
    ]
    drives = tuple(parse(drive) for drive in [*mass_drives(inputs), *extra])
    air = frozenset((*inputs.of(AMBIENT), *inputs.bodies))
    gate_names = names(parse(inputs.gate)) if inputs.gate else frozenset()
    soaked = tuple(bool(names(drive) & air) and not names(drive) & gate_names for drive in drives)
    return MassLibrary(tuple(masses), drives, parse(inputs.gate or 0.0), soaked)


@dataclass(frozen=True)
class Response:
    """Filtered library of a recording at its readings: columns (R, M) and start-value decays (R, masses)."""

    columns: Array
    decays: Array


def respond(library: MassLibrary, grid: Grid) -> Response:
    """Filter every drive through every mass."""
    grid = replace(grid, outputs=("y",), readings=grid.readings[:, :1])
    series = [np.broadcast_to(evaluate(d, grid.ends).value, (2 * len(grid.step),)) for d in library.drives]
    gate = float(np.ravel(evaluate(library.gate, {n: s[0] for n, s in grid.nodes.items()}).value)[0])
    count, rows = len(library.masses), len(grid.read)
    filtered = np.empty((rows, len(series), count))
    decays = np.empty((rows, count))
    for first in range(0, count, _CHUNK):
        masses = library.masses[first : first + _CHUNK]
        model = _carriers(masses, library.gate)
        pieces = [
            Column(k * len(masses) + i, f"s{i}", s) for k, s in enumerate(series) for i in range(len(masses))
        ]
        trajectory = simulate(make_system(model, grid), {})
        found = sensitivities(trajectory, (), tuple(model.states), pieces)[:, 0]
        decays[:, first : first + len(masses)] = found[:, : len(masses)]
        filtered[:, :, first : first + len(masses)] = found[:, len(masses) :].reshape(rows, len(series), -1)
    for k, soaked in enumerate(library.soaked):
        if soaked:
            a, b = np.array([m.rates for m in library.masses]).T
            filtered[:, k] += decays * series[k][0] / (a + b * gate)
    return Response(np.column_stack([np.ones(rows), filtered.reshape(rows, -1)]), decays)


def _carriers(masses: Sequence[Mass], gate: Expression) -> Model:
    states, terms = {}, []
    for i, mass in enumerate(masses):
        a, b = mass.rates
        states[f"s{i}"] = State(f"s{i}", "um", None, Number(0.0), 1.0, 1 / HOUR)
        rate = f"{a!r} + {b!r}*({text(gate)})" if b else f"{a!r}"
        terms.append(Term("decay", f"s{i}", parse(f"-({rate})*s{i}")))
    return Model("masses", {}, states, tuple(terms), {"y": parse(" + ".join(states))}, "h")


def block_grams(response: Response, target: Array, block: NDArray[np.intp]) -> dict[int, Gram]:
    """Normal equations by block of a recording, in columns [library, start values]; readings that are NaN
    count nowhere.

    Args:
        target: (R,) readings over their noise.
        block: (R,) block of each reading.
    """
    columns = np.column_stack([response.columns, response.decays])
    known = np.isfinite(target)
    return {
        int(b): gram(columns[known & (block == b)], target[known & (block == b)]) for b in np.unique(block)
    }


def pooled(grams: Sequence[dict[int, Gram]], library_size: int, start_sd: float, weights: Array) -> Gram:
    """Normal equations of the library over recordings with the start values taken out of each.

    Args:
        grams: by recording, by block.
        start_sd: spread of a start value, over the noise.
        weights: (B,) how often each block counts.
    """
    parts = []
    for recording in grams:
        used = [b for b in recording if weights[b] > 0]
        if used:
            whole = total([recording[b] for b in used], [weights[b] for b in used])
            starts = np.arange(library_size, len(whole.vector))
            parts.append(project_out(whole, starts, np.full(len(starts), start_sd**-2.0)))
    return total(parts)


def free_run(
    library: MassLibrary, response: Response, theta: Array, readings: Array, start_sd: float
) -> Array:
    """Prediction (R,) of a recording that was left out, zeroed on its first reading alone.

    The same Bayesian step as `fitting.predict_recording`: the masses in use share what the first reading
    says.
    """
    predicted = response.columns @ theta
    used = sorted(set(library.mass[np.flatnonzero(theta)]) - {-1})
    first = np.flatnonzero(np.isfinite(readings))
    if used and len(first):
        decay = response.decays[first[0], used]
        gain = decay / (decay @ decay + start_sd**-2.0)
        predicted = predicted + response.decays[:, used] @ gain * (readings[first[0]] - predicted[first[0]])
    return np.asarray(predicted)


def mass_model(
    library: MassLibrary, output: str, unit: str, support: Sequence[int], theta: Array, start_sd: float
) -> Model:
    """The chosen columns written as a model: one hidden state for each mass in use.

    Args:
        theta: (M,) gains.
        start_sd: spread of the start values, in the unit of the output.
    """
    states: dict[str, State] = {}
    terms: list[Term] = []
    offset = f"{output}_0"
    parameters = {offset: Parameter(float(theta[0]), unit)}
    chosen = [k for k in support if k > 0]
    gated = text(library.gate)
    for number, mass in enumerate(sorted({int(library.mass[k]) for k in chosen}), start=1):
        state = f"{output}_{number}"
        a, b = library.masses[mass].rates
        rate = f"{state}_a"
        parameters[rate] = Parameter(a, "1/h", a / 3, a * 3)
        if b:
            parameters[f"{state}_b"] = Parameter(b, "1/h", 0.0, 4 * b)
            rate = f"({rate} + {state}_b*{gated})"
        terms.append(Term(f"{state} settles", state, parse(f"-{rate}*{state}")))
        start = []
        for k in (k for k in chosen if library.mass[k] == mass):
            drive = int(library.drive[k])
            name = f"{state}_g{drive + 1}"
            parameters[name] = Parameter(float(theta[k]), f"{unit}/h")
            driven = text(library.drives[drive])
            terms.append(Term(f"{driven} drives {state}", state, parse(f"{name}*({driven})")))
            if library.soaked[drive]:
                start.append(f"{name}*({driven})")
        begin = parse(f"({' + '.join(start)})/{rate}") if start else Number(0.0)
        states[state] = State(state, unit, None, begin, start_sd, 1 / HOUR)
    expression = parse(" + ".join([*states, offset]))
    return Model(output, parameters, states, tuple(terms), {output: expression}, "h")
