"""PySINDy as its users take it: rates of the outputs on polynomials of outputs and inputs, thresholded
(STLSQ).

    d/dt x = Theta(x, u) Xi

The plain form differentiates the readings (smoothed finite differences), the weak form integrates against
test functions (`WeakPDELibrary`). Form, degree and threshold are those that predict left-out recordings best
in free runs (quarters of a single one). It serves for comparison, so its coefficients are those of PySINDy:
nothing is fitted afterwards.
"""

from __future__ import annotations

import contextlib
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_grid, predict
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, predict_recording
from discovery.fitting.held import held_fit
from discovery.models import Model, Parameter, State
from discovery.models.model import TIME_UNITS
from discovery.recordings import Campaign
from discovery.terms import Term, parse

Array = NDArray[np.float64]

THRESHOLDS = (0.01, 0.03, 0.1, 0.3)  # of coefficients of standardised outputs and inputs, per time scale
DEGREES = (1, 2)
TEST_FUNCTIONS = 500  # of the weak form in each recording
GAP = 6.0  # usual distances of two readings: across a longer one nothing is interpolated
WINDOW = 11  # readings that the smoother of the plain form sees
FOLDS = 4
RIDGE = 0.05  # STLSQ's own default
FAR = 1e6  # instead of the error of a model that runs away, over the spread


@dataclass(frozen=True)
class Setting:
    """A setting that a user of PySINDy would try."""

    weak: bool
    degree: int
    threshold: float


@dataclass(frozen=True, eq=False)  # a table is itself alone: its weak rows are made once
class Table:
    """Outputs and inputs of a stretch without gaps at equal steps, standardised; its time in time scales."""

    time: Array  # (T,)
    x: Array  # (T, Y)
    u: Array  # (T, U)


def settings(form: str = "auto") -> list[Setting]:
    """Settings to try: "plain", "weak", or both ("auto"), with every degree and threshold."""
    forms = {"auto": (False, True), "plain": (False,), "weak": (True,)}[form]
    return [Setting(*one) for one in product(forms, DEGREES, THRESHOLDS)]


def fit_plain(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Sequence[str],
    tried: Sequence[Setting],
    seed: int = 0,
) -> tuple[Fit, Setting, dict[str, Any]]:
    """A PySINDy model of the outputs, and what was chosen.

    Of several settings, the one is taken that is best on what is left out and stays finite on the recordings;
    no term where none does.

    Args:
        inputs: channels u.
        tried: settings; a single one is not compared.
        seed: of the test functions.

    Raises:
        RunsAwayError: the model of a single setting does not stay finite.
    """
    grids = {r: make_grid(campaign, r, inputs, outputs) for r in recordings}
    frame = _Frame.of(grids, outputs, inputs)
    tables = {r: frame.tables(grid) for r, grid in grids.items()}
    everything = [table for some in tables.values() for table in some]

    def held(stretches: Sequence[Table], one: Setting) -> Fit:
        model = frame.model(_coefficients(frame, stretches, one, seed), one.degree, campaign)
        return held_fit(model, campaign, recordings, outputs)

    if len(tried) == 1:
        return held(everything, tried[0]), tried[0], _report(tried[0], math.nan)
    folds = _folds(list(tables), tables)
    errors = [_left_out(frame, folds, campaign, grids, one, seed) for one in tried]
    order = [int(k) for k in np.argsort(errors, kind="stable")]
    for k in order:
        with contextlib.suppress(RunsAwayError):
            return held(everything, tried[k]), tried[k], _report(tried[k], errors[k])
    best = tried[order[0]]
    return held([], best), best, _report(best, errors[order[0]])


def _report(one: Setting, error: float) -> dict[str, Any]:
    return {
        "form": "weak" if one.weak else "plain",
        "degree": one.degree,
        "threshold": one.threshold,
        "left_out_rms": error,
    }


Fold = tuple[dict[str, tuple[float, float]], list[Table]]  # what is left out, and what stays


@dataclass(frozen=True)
class _Frame:
    """Means, spreads and the unit of time in which coefficients are of the order of one."""

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    centre: Array  # (Y + U,)
    spread: Array
    scale: float  # s
    step: float  # s

    @staticmethod
    def of(grids: Mapping[str, Grid], outputs: Sequence[str], inputs: Sequence[str]) -> _Frame:
        rows = [np.column_stack([g.readings, *(g.nodes[u][g.read] for u in inputs)]) for g in grids.values()]
        table = np.concatenate(rows)
        steps = [float(np.median(np.diff(g.time[g.read]))) for g in grids.values() if len(g.read) > 1]
        spread = np.nanstd(table, axis=0)
        longest = max(float(g.time[-1]) for g in grids.values())
        return _Frame(
            tuple(outputs),
            tuple(inputs),
            np.nanmean(table, axis=0),
            np.where(spread > 0, spread, 1.0),
            longest / 10,
            min(steps, default=longest / 100),
        )

    def tables(self, grid: Grid) -> list[Table]:
        """The stretches of a recording without long gaps, on equal steps."""
        stamps = grid.time[grid.read]
        distances = np.diff(stamps)
        cuts = np.flatnonzero(distances > GAP * max(self.step, _usual(distances))) + 1
        parts = np.split(np.arange(len(stamps)), cuts)
        made = [self._table(grid, stamps[one], grid.readings[one]) for one in parts]
        return [table for table in made if table is not None]

    def _table(self, grid: Grid, stamps: Array, readings: Array) -> Table | None:
        """One stretch; None where it is too short to be smoothed."""
        known = np.isfinite(readings)
        time = np.arange(stamps[0], stamps[-1] + 0.5 * self.step, self.step) if len(stamps) else stamps
        if len(time) < 2 * WINDOW or not known.any(axis=0).all():
            return None
        series = [np.interp(time, stamps[k], y[k]) for y, k in zip(readings.T, known.T, strict=True)]
        series += [grid.samples[u].at(time) for u in self.inputs]
        both = (np.column_stack(series) - self.centre) / self.spread
        return Table(time / self.scale, both[:, : len(self.outputs)], both[:, len(self.outputs) :])

    def model(self, xi: Array, degree: int, campaign: Campaign) -> Model:
        """The model of standardised coefficients (Y, F), written in the units of the channels."""
        names = [*self.outputs, *self.inputs]
        standard = [
            f"({n} - {m:.9g})/{s:.9g}" for n, m, s in zip(names, self.centre, self.spread, strict=True)
        ]
        products = _powers(len(names), degree)
        parameters: dict[str, Parameter] = {}
        terms: list[Term] = []
        for k, output in enumerate(self.outputs):
            unit = campaign.channels[output].unit
            for j in np.flatnonzero(xi[k]):
                name = f"{output}_x{j}"
                factors = "*".join(f"({standard[i]})" for i in products[j])
                parameters[name] = Parameter(
                    float(xi[k, j] * self.spread[k] / self.scale * TIME_UNITS["h"]), f"{unit}/h"
                )
                label = " ".join(names[i] for i in products[j]) or "1"
                expression = parse(f"{name}*{factors}" if factors else name)
                terms.append(Term(f"{label} on {output}", output, expression))
        states = {y: State(y, campaign.channels[y].unit, scale=1.0 / TIME_UNITS["h"]) for y in self.outputs}
        return Model("PySINDy", parameters, states, tuple(terms), {}, "h")


def _usual(distances: Array) -> float:
    """The usual distance of two readings: that in which half of the recording lies. Of three readings in a
    row and a minute without any, it is the minute.
    """
    if not distances.size:
        return 0.0
    ordered = np.sort(distances)
    return float(ordered[np.searchsorted(np.cumsum(ordered), 0.5 * ordered.sum())])


def _powers(count: int, degree: int) -> list[tuple[int, ...]]:
    """Factors of each column of `PolynomialLibrary(degree)`, in its order."""
    return [c for d in range(degree + 1) for c in combinations_with_replacement(range(count), d)]


def _coefficients(frame: _Frame, tables: Sequence[Table], setting: Setting, seed: int) -> Array:
    """Coefficients (Y, F) of STLSQ; all zero if no stretch is long enough for a derivative."""
    import pysindy

    if not tables:
        return np.zeros((len(frame.outputs), len(_powers(len(frame.spread), setting.degree))))
    library = pysindy.PolynomialLibrary(degree=setting.degree)
    optimiser = pysindy.STLSQ(threshold=setting.threshold, alpha=RIDGE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "sparsity parameter is too big": an empty support is no fault
        if not setting.weak:
            sindy = pysindy.SINDy(
                optimizer=optimiser,
                feature_library=library,
                differentiation_method=pysindy.SmoothedFiniteDifference(
                    smoother_kws={"window_length": WINDOW, "polyorder": 3}
                ),
            )
            sindy.fit([t.x for t in tables], t=[t.time for t in tables], u=[t.u for t in tables])
            return np.asarray(sindy.coefficients())
        rows = [_weak_rows(t, setting.degree, seed) for t in tables]
        optimiser.fit(np.concatenate([a for a, _ in rows]), np.concatenate([b for _, b in rows]))
        return np.asarray(optimiser.coef_)


@lru_cache(maxsize=512)
def _weak_rows(table: Table, degree: int, seed: int) -> tuple[Array, Array]:
    """Rows (K, F) and targets (K, Y) of the weak library of one recording, the random domains seeded.

    The rows are what `transform` of the library gives. Its arrays with named axes take ten times as long to
    be cut into the domains as plain ones.
    """
    import pysindy

    weak = _weak_form(table.time.tobytes(), seed)
    both = pysindy.AxesArray(np.column_stack([table.x, table.u]), {"ax_time": 0, "ax_coord": 1})
    functions = np.asarray(pysindy.PolynomialLibrary(degree=degree, include_bias=True).fit_transform(both))
    pairs = zip(weak.fullweights0, weak.inds_k, strict=True)
    rows = [np.tensordot(weights, functions[np.ix_(*at)], ((0,), (0,))) for weights, at in pairs]
    return np.array(rows), np.asarray(weak.convert_u_dot_integral(table.x))


@lru_cache(maxsize=32)
def _weak_form(time: bytes, seed: int) -> Any:
    """The weak library on a grid of times (T,); its domains depend on nothing but the grid and the seed."""
    import pysindy

    state = np.random.get_state()  # noqa: NPY002 - the library draws from the global generator
    np.random.seed(seed)  # noqa: NPY002
    try:
        return pysindy.WeakPDELibrary(spatiotemporal_grid=np.frombuffer(time), K=TEST_FUNCTIONS)
    finally:
        np.random.set_state(state)  # noqa: NPY002


def _left_out(
    frame: _Frame,
    folds: Sequence[Fold],
    campaign: Campaign,
    grids: Mapping[str, Grid],
    setting: Setting,
    seed: int,
) -> float:
    """rms of free runs on left-out data over the spread, all outputs together."""
    squares: list[Array] = []
    for out, train in folds:
        if not train:
            continue
        model = frame.model(_coefficients(frame, train, setting, seed), setting.degree, campaign)
        for name, (begin, end) in out.items():
            try:
                run = predict_recording(model, campaign, name, frame.outputs, None, grids[name])
                left = (grids[name].readings - predict(run)) / frame.spread[: len(frame.outputs)]
            except RunsAwayError:
                return FAR
            share = np.linspace(0.0, 1.0, len(left))
            squares.append(np.ravel(left[(share >= begin) & (share <= end)]) ** 2)
    found = np.concatenate(squares) if squares else np.array([FAR**2])
    mean = float(np.sqrt(np.nanmean(found)))
    return mean if np.isfinite(mean) else FAR


def _folds(names: Sequence[str], tables: Mapping[str, list[Table]]) -> list[Fold]:
    """The left-out share of each recording, and the remaining tables."""
    if len(names) > 1:
        parts = [names[k::FOLDS] for k in range(min(FOLDS, len(names)))]
        return [
            (dict.fromkeys(part, (0.0, 1.0)), [t for n in names if n not in part for t in tables[n]])
            for part in parts
        ]
    (name,) = names
    found = []
    last = max((float(t.time[-1]) for t in tables[name]), default=0.0)
    for k in range(FOLDS):
        begin, end = k / FOLDS, (k + 1) / FOLDS
        rest = [p for t in tables[name] for p in _outside(t, begin * last, end * last)]
        found.append(({name: (begin, end)}, rest))
    return found


def _outside(table: Table, begin: float, end: float) -> list[Table]:
    """The parts of a table before and after a stretch of time, if they are long enough."""
    parts = (table.time < begin, table.time > end)
    return [Table(table.time[k], table.x[k], table.u[k]) for k in parts if k.sum() > 2 * WINDOW]
