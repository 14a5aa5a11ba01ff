"""Feature libraries for `pysindy.SINDy`: inputs through first-order lags, and terms through a model's own
dynamics.

The left-hand side of both is the readings themselves, so nothing is differentiated:

    library = FilteredInputs(["time", "P0", "P1"])
    model = SINDy(optimizer=SparseSearch(library), feature_library=library)
    model.fit([X_a, X_b], t=1, x_dot=[Y_a, Y_b])        # rows of X: time [s], P0, P1
    model.print(lhs=["E_Y"])                            # E_Y = 0.020 lag(P0, 3600)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pysindy import AxesArray
from pysindy.feature_library.base import BaseFeatureLibrary, x_sequence_or_item

from discovery.dynamics.grid import interleaved
from discovery.sparse.bank import filtered
from discovery.sparse.search import Families
from discovery.terms import Expression, evaluate, names, parse, text

Array = NDArray[np.float64]

COUNT = 30  # time constants of the grid
SEEN = 3.0  # time constants in the longest trajectory at least: what is slower only adds up its input
FINER = 10.0  # times the distance of two readings: what settles quicker acts at once
STILL = 0.1  # of its rate with a flow: how fast a lag forgets without it, before a fit has found it


@dataclass(frozen=True)
class Feature:
    """A column: a drive that acts at once (tau 0), through a lag (tau in s), or added up (tau infinite).

    The offset is the drive 1. A lag may forget more slowly while a flow stands still: its rate is then
    the share `rest` of 1/tau, and lag(u, 600, 6000) names both time constants.
    """

    drive: str
    tau: float = 0.0
    rest: float = 1.0

    def __str__(self) -> str:
        if self.tau == 0.0:
            return self.drive
        if np.isinf(self.tau):
            return f"integral({self.drive})"
        still = "" if self.rest == 1.0 else f", {self.tau / self.rest:.4g}"
        return f"lag({self.drive}, {self.tau:.4g}{still})"


class FilteredInputs(BaseFeatureLibrary):  # type: ignore[misc]
    """PySINDy library of inputs u, without a lag and through first-order lags, tau ds/dt = u - s.

    The lags are exact, also at irregular time stamps: s moves by (1 - exp(-dt/tau)) (u - s) in a time dt in
    which the input u is held.

    After `fit` the features have a grid of time constants. `SparseSearch(library)` moves the time constants,
    and the library then holds only the chosen features.

    Args:
        names: names of the columns of each trajectory (T, len(names)). One is "time" [s], increasing. One
            may be "read", 1 in the rows that are used (default all); the others are inputs.
        drives: expressions of the inputs that go through lags; default each input.
        time_constants: smallest and largest of the grid [s]; default a tenth of the time between two readings
            (the time between two inputs, if that is longer) and the length of the longest trajectory.
        linear: inputs that run straight between their stamps; the others are held.
        settled: drives whose lag starts in balance with the first value; the others start at zero.
        lasting: how long [s] other drives have been about what they are at the start, T: their lags start
            with the share T/(T + tau) of the balance.
        at_once: whether a drive may also act without a lag.
        integrals: drives that may be integrated without limit, such as a current (charge).
        offset: whether the library has a constant.
        zeroed: whether each trajectory has its own zero, as a probe that is set to zero at the start.
        gate: expression, 0 to 1, of a flow that goes on and off: drives then also go through lags that
            forget at the rate (still + (1 - still) gate)/tau, tau ds/dt = u - (still + (1 - still) gate) s.
        still: how fast these forget without the flow, of their rate with it.
    """

    def __init__(
        self,
        names: Sequence[str],
        drives: Sequence[str] | None = None,
        time_constants: tuple[float, float] | None = None,
        linear: Sequence[str] = (),
        settled: Sequence[str] = (),
        at_once: bool = True,
        integrals: Sequence[str] = (),
        offset: bool = True,
        zeroed: bool = False,
        gate: str | None = None,
        still: float = STILL,
        lasting: Mapping[str, float] | None = None,
    ) -> None:
        self.names = names
        self.drives = drives
        self.time_constants = time_constants
        self.linear = linear
        self.settled = settled
        self.at_once = at_once
        self.integrals = integrals
        self.offset = offset
        self.zeroed = zeroed
        self.gate = gate
        self.still = still
        self.lasting = lasting

    @x_sequence_or_item
    def fit(self, x_full: Sequence[Any], y: Any = None) -> Self:  # noqa: ARG002
        """Make the grid of features."""
        if "time" not in self.names:
            raise ValueError(f"names must have a column 'time'; got {list(self.names)}")
        width = x_full[0].shape[-1]
        if width != len(self.names):
            raise ValueError(f"a trajectory has {width} columns, names has {len(self.names)}")
        inputs = [name for name in self.names if name not in ("time", "read")]
        self.drives_ = [text(parse(d)) for d in (self.drives if self.drives is not None else inputs)]
        self.taus_ = np.geomspace(*(self.time_constants or self._usual(x_full)), COUNT)
        at_once = [Feature("1")] if self.offset else []
        at_once += [Feature(d) for d in self.drives_ if self.at_once]
        at_once += [Feature(d, np.inf) for d in self.integrals]
        self.rests_ = [1.0] if self.gate is None else [1.0, self.still]
        curves = [
            Feature(d, float(t), rest) for rest in self.rests_ for d in self.drives_ for t in self.taus_
        ]
        self.features_ = [*at_once, *curves]
        count = np.r_[np.ones(len(at_once), int), np.full(len(self.rests_) * len(self.drives_), COUNT)]
        free = np.full(len(count), np.inf)
        bank = np.r_[np.zeros(len(at_once), int), np.repeat(np.arange(len(self.rests_)), len(self.drives_))]
        self.families_ = Families(np.r_[0, np.cumsum(count)[:-1]], count, -free, free, bank=bank)
        self.grid_ = tuple(self.features_)
        self.drive_of_family_ = [self.grid_[i].drive for i in self.families_.start]
        self.n_features_in_ = width
        self.n_output_features_ = len(self.features_)
        return self

    def _usual(self, trajectories: Sequence[Any]) -> tuple[float, float]:
        """Least and greatest time constant from sampling and length."""
        stamps = [self._column(x, "time") for x in trajectories]
        read = [t[self._read(x)] for t, x in zip(stamps, trajectories, strict=True)]
        longest = max(float(t[-1] - t[0]) for t in read)
        step, reading = (
            min(float(np.median(np.diff(t))) for t in times if len(t) > 1) for times in (stamps, read)
        )
        return min(max(step, reading / FINER), longest / 30), longest / SEEN

    def _column(self, x: Any, name: str) -> Array:
        return np.asarray(x, dtype=float)[:, list(self.names).index(name)]

    def _read(self, x: Any) -> NDArray[np.intp]:
        if "read" not in self.names:
            return np.arange(x.shape[0])
        return np.flatnonzero(self._column(x, "read"))

    @x_sequence_or_item
    def transform(self, x_full: Sequence[Any]) -> list[Any]:
        """Features (rows that are wanted, n_output_features_) of each trajectory (T, len(names))."""
        made = [self._features(x) for x in x_full]
        self.rows_ = [len(columns) for columns in made]
        self.nuisance_ = [self._decays(x) for x in x_full]
        self.times_ = [self._column(x, "time")[self._read(x)] for x in x_full]
        return [AxesArray(columns, {"ax_time": 0, "ax_coord": 1}) for columns in made]

    def _decays(self, x: Any) -> Array:
        """What is left of a start value (rows, banks * COUNT) for each time constant of the grid; a zero
        stays.
        """
        read, step = self._read(x), np.diff(self._column(x, "time"))
        since = [np.r_[0.0, np.cumsum(step * self._rate(x, rest))][read] for rest in self.rests_]
        left = np.hstack([np.exp(-one[:, None] / self.taus_) for one in since])
        return np.column_stack([left, np.ones(len(left))]) if self.zeroed else np.asarray(left)

    def _rate(self, x: Any, rest: float) -> Array:
        """How fast a lag forgets in each interval (T - 1,), of 1/tau."""
        steps = np.asarray(x).shape[0] - 1
        if rest == 1.0 or self.gate is None:
            return np.ones(steps)
        inputs = {name: self._column(x, name) for name in self.names}
        gate = np.broadcast_to(evaluate(parse(self.gate), inputs).value, (steps + 1,))
        straight = names(parse(self.gate)) & set(self.linear)
        gate = (gate[:-1] + gate[1:]) / 2 if straight else gate[:-1]
        return np.asarray(rest + (1.0 - rest) * gate)

    def _share(self, drive: str, taus: Array) -> Array:
        """The share of its balance with a drive that a lag begins with, for each time constant."""
        if drive in self.settled:
            return np.ones(len(taus))
        lasts = (self.lasting or {}).get(drive, 0.0)
        return np.asarray(lasts / (lasts + taus))

    def _features(self, x: Any) -> Array:
        time, read = self._column(x, "time"), self._read(x)
        inputs = {name: self._column(x, name) for name in self.names if name not in ("time", "read")}
        ends: dict[str, Any] = {
            name: interleaved(u[:-1], u[1:] if name in self.linear else u[:-1]) for name, u in inputs.items()
        }
        nodes: dict[str, Any] = inputs
        wanted = dict.fromkeys(f.drive for f in self.features_)
        trees: dict[str, Expression] = {d: parse(d) for d in wanted}
        lagged = [f for f in self.features_ if 0 < f.tau < np.inf]
        rates = {rest: self._rate(x, rest) for rest in dict.fromkeys(f.rest for f in lagged)}
        step = np.diff(time)
        columns: dict[Feature, Array] = {}
        for drive, tree in trees.items():
            now = np.broadcast_to(evaluate(tree, nodes).value, time.shape)
            columns[Feature(drive)] = np.asarray(now[read])
            pair = np.broadcast_to(evaluate(tree, ends).value, (2 * len(step),)).reshape(-1, 2)
            for rest, rate in rates.items():  # tau ds/dt = u - rate s: a clock that runs at this rate
                taus = np.array(sorted({f.tau for f in lagged if f.drive == drive and f.rest == rest}))
                if not len(taus):
                    continue
                left, right = (np.ascontiguousarray(side[:, None] / rate[:, None]) for side in pair.T)
                start = now[0] * self._share(drive, taus)[None, :]
                found = filtered(left, right, step * rate, read, taus, start)[:, 0]
                columns |= {Feature(drive, float(tau), rest): found[:, i] for i, tau in enumerate(taus)}
            if Feature(drive, np.inf) in self.features_:
                sums = np.r_[0.0, np.cumsum(pair.mean(axis=1) * step)]
                columns[Feature(drive, np.inf)] = sums[read]
        return np.column_stack([columns[f] for f in self.features_])

    def feature_at(self, family: int, place: float) -> Feature:
        """The feature at a place of a family of the grid."""
        first: Feature = self.grid_[self.families_.start[family]]
        if self.families_.count[family] == 1:
            return first
        return replace(first, tau=float(self.taus_[0] * (self.taus_[1] / self.taus_[0]) ** place))

    def keep(self, features: Sequence[Feature]) -> None:
        """Hold these features alone from now on."""
        self.features_ = list(features)
        self.n_output_features_ = len(self.features_)

    def get_feature_names(self, input_features: Sequence[str] | None = None) -> list[str]:  # noqa: ARG002
        """Names as formulas: P0, lag(P0, 3600), integral(P0)."""
        return [str(feature) for feature in self.features_]


class ModelTerms(BaseFeatureLibrary):  # type: ignore[misc]
    """Terms of a model filtered through its own dynamics: how its outputs move with the coefficient of each
    term.

    The columns are those of the trajectories that a model was fitted to; the left-hand side that belongs to
    them is what the fit leaves plus what its coefficients make: residual + J theta = J theta_new.

    Args:
        names: of the coefficients.
        columns: (R, M) sensitivities by trajectory, over the noise.
        nuisance: (R, m) sensitivities of start values, by trajectory.
        precision: (m,) inverse variances of their priors, by trajectory.
        times: (R,) instants of the rows [s], by trajectory.
    """

    def __init__(
        self,
        names: Sequence[str],
        columns: Sequence[Array],
        nuisance: Sequence[Array],
        precision: Sequence[Array],
        times: Sequence[Array],
    ) -> None:
        self.names = names
        self.columns = columns
        self.nuisance = nuisance
        self.precision = precision
        self.times = times

    @x_sequence_or_item
    def fit(self, x_full: Sequence[Any], y: Any = None) -> Self:  # noqa: ARG002
        """Check that the trajectories are those of the fit."""
        rows = [len(x) for x in x_full]
        if rows != [len(one) for one in self.columns]:
            raise ValueError(f"the terms were filtered for trajectories of other lengths than {rows}")
        self.rows_, self.times_ = rows, list(self.times)
        self.nuisance_, self.precision_ = list(self.nuisance), list(self.precision)
        self.drive_of_family_ = list(self.names)
        self.n_features_in_ = x_full[0].shape[-1]
        self.n_output_features_ = len(self.names)
        return self

    @x_sequence_or_item
    def transform(self, x_full: Sequence[Any]) -> list[Any]:
        """The filtered terms (R, M) of each trajectory."""
        self.fit(x_full)
        return [AxesArray(one, {"ax_time": 0, "ax_coord": 1}) for one in self.columns]

    def get_feature_names(self, input_features: Sequence[str] | None = None) -> list[str]:  # noqa: ARG002
        """Names of the coefficients."""
        return list(self.names)
