"""Discovery from Python: frames or arrays in, a sparse model with its evidence out, as a scikit-learn
estimator.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from discovery.dynamics import make_grid, predict
from discovery.dynamics.system import inputs_of
from discovery.errors import UserError
from discovery.fitting import predict_recording
from discovery.frames import campaign_from_frames
from discovery.models.dimensions import with_coefficient_units
from discovery.models.equations import equations
from discovery.recordings import Campaign
from discovery.schema import suggest
from discovery.sparse.discover import discover as discover_in
from discovery.sparse.discover import fitting
from discovery.sparse.options import SparseOptions

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Channels = Mapping[str, Mapping[str, Any]]

INPUT = {"role": "other input", "unit": "1"}
OUTPUT = {"role": "other output", "unit": "1"}


def discover(
    frames: Mapping[str, pd.DataFrame] | pd.DataFrame,
    outputs: Sequence[str],
    channels: Channels | None = None,
    **options: Any,
) -> SparseDiscovery:
    """Discover a sparse model of some columns of frames; the other columns are its inputs.

    Args:
        frames: recordings by name, or a single one. The index is time (seconds, or a DatetimeIndex); NaN
            means that nothing was measured at that time.
        outputs: columns that the model predicts.
        channels: column -> {"role": ..., "unit": ...} as in a campaign file; default roles are "other input"
            and "other output", without a unit.
        options: as in an experiment file (`form`, `library`, `bounds`, `keep`, `optimiser`, ...); `optimiser`
            may also be an optimiser of PySINDy, as in `pysindy.STLSQ(threshold=0.05)`, or an object of your
            own class derived from `pysindy.optimizers.BaseOptimizer`.

    Returns:
        The fitted estimator: `equations()`, `coefficients()`, `predict(X)`, `summary()`, `plot()`.

    Raises:
        UserError: a column is missing, or an option does not fit.
    """
    recordings = dict(frames) if isinstance(frames, Mapping) else {"recording": frames}
    if not recordings:
        raise UserError("no frame to discover from; give a recording by its name, as {'monday': frame}")
    first = next(iter(recordings.values()))
    for output in outputs:
        if output not in first:
            raise UserError(f"no column '{output}'; {suggest(output, [str(c) for c in first.columns])}")
    known = list(SparseDiscovery().get_params())
    for name in options:
        if name not in known:
            raise UserError(f"no option '{name}'; {suggest(name, known)}")
    found = SparseDiscovery(channels=channels, **options)
    inputs = [str(c) for c in first.columns if c not in outputs]
    x = _stacked({name: frame[inputs] for name, frame in recordings.items()})
    return found.fit(x, _stacked({name: frame[list(outputs)] for name, frame in recordings.items()}))


def _is_text(one: Any) -> bool:
    return isinstance(one, str)


class SparseDiscovery(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Sparse dynamics of outputs y driven by inputs X, as a scikit-learn estimator.

    form="masses": y = zero + sum_i s_i with tau_i ds_i/dt = gain_i u_i - s_i.
    form="rates": dy/dt = sum_k c_k f_k(y, u) with f_k from `library`.

    Terms enter by orthogonal matching pursuit (Pati, Rezaiifar & Krishnaprasad, Asilomar 1993); data left
    out choose their number. `docs/discovery.md` describes the method.

    X and y are frames or arrays with a row for each instant. The index of a frame is time, or (recording,
    time). Rows of an array are `step` seconds apart. In the folds of `GridSearchCV`, a frame keeps its time
    and an array does not: use `TimeSeriesSplit` for arrays.

    Args:
        channels: column -> {"role": ..., "unit": ...}; default inputs and outputs without a unit.
        step: time between two rows of an array [s]; a frame has its own time.
        form, library, max_terms, time_constants, hidden, stable, keep, forbid, bounds, optimiser,
            optimiser_arguments, tolerance, bootstraps, seed: as in an experiment file.

    Attributes:
        model_: the fitted model; its parameters have 95 % intervals.
        discovery_: the path of the search, and stability and cost of each term.
        inputs_, outputs_: names of the columns of X and y; an array has x0, x1, ... and y0, y1, ...
        noise_: reading noise of each output, in its unit.

    Methods raise `UserError` if a column, a channel or an option does not fit.
    """

    def __init__(
        self,
        channels: Channels | None = None,
        step: float = 1.0,
        form: str = "auto",
        library: Sequence[str] | None = None,
        max_terms: int = 15,
        time_constants: tuple[float, float] | None = None,
        hidden: str = "auto",
        stable: bool | None = None,
        keep: Sequence[str] = (),
        forbid: Sequence[str] = (),
        bounds: Mapping[str, tuple[float, float]] | None = None,
        optimiser: Any = "search",
        optimiser_arguments: Mapping[str, Any] | None = None,
        tolerance: float | None = None,
        bootstraps: int = 0,
        seed: int = 0,
    ) -> None:
        self.channels = channels
        self.step = step
        self.form = form
        self.library = library
        self.max_terms = max_terms
        self.time_constants = time_constants
        self.hidden = hidden
        self.stable = stable
        self.keep = keep
        self.forbid = forbid
        self.bounds = bounds
        self.optimiser = optimiser
        self.optimiser_arguments = optimiser_arguments
        self.tolerance = tolerance
        self.bootstraps = bootstraps
        self.seed = seed

    def fit(self, X: Any, y: Any) -> Self:
        """Discover a model of y (T,) or (T, outputs) driven by X (T, inputs).

        Raises:
            UserError: X and y differ in length, or an option or a channel does not fit.
        """
        x, z = _framed(X, self.step, "x"), _framed(y, self.step, "y")
        if len(x) != len(z):
            raise UserError(f"X has {len(x)} rows and y has {len(z)}; give a row of both for each instant")
        self.n_features_in_ = x.shape[1]
        self.inputs_, self.outputs_ = [str(c) for c in x.columns], [str(c) for c in z.columns]
        campaign = self._campaign(x, z)
        recordings = list(campaign.recordings)
        found = discover_in(campaign, recordings, self.outputs_, self._options())
        fit = fitting(found.report)(found.model, campaign, recordings, self.outputs_)
        self.discovery_ = found
        self.model_ = with_coefficient_units(fit.model, campaign.channels)
        self.noise_ = fit.noise.white
        self.first_ = np.array([_first(z[name].to_numpy(float)) for name in z.columns])
        return self

    def predict(self, X: Any, first: Any = None) -> Array:
        """Run the model freely: only the first reading is used, if it is given.

        Args:
            X: (T, inputs).
            first: (outputs,) readings at the first instant, or (recordings, outputs); default those of the
                fit.

        Returns:
            (T,), or (T, outputs) for several outputs.

        Raises:
            UserError: X has other columns than in the fit.
        """
        check_is_fitted(self, "model_")
        x = _framed(X, self.step, "x")
        if [str(c) for c in x.columns] != self.inputs_:
            raise UserError(f"X has the columns {list(x.columns)}, the fit had {self.inputs_}")
        begin = self.first_ if first is None else np.atleast_1d(np.asarray(first, dtype=float))
        runs: list[Array] = []
        for name, table in _recordings(x).items():
            runs.append(self._run(name, table, begin if begin.ndim == 1 else begin[len(runs)]))
        out = np.concatenate(runs)
        return out[:, 0] if out.shape[1] == 1 else out

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """Return R2 of free runs from the first reading of each recording, as a mean over the outputs."""
        from sklearn.metrics import r2_score

        z = _framed(y, self.step, "y")
        firsts = [[_first(t[c].to_numpy(float)) for c in t.columns] for t in _recordings(z).values()]
        predicted = self.predict(X, first=np.array(firsts)).reshape(len(z), -1)
        readings = z.to_numpy(float)
        known = np.isfinite(readings).all(axis=1)
        weight = None if sample_weight is None else np.asarray(sample_weight)[known]
        return float(r2_score(readings[known], predicted[known], sample_weight=weight))

    def coefficients(self) -> pd.DataFrame:
        """Return a row for each parameter of the model: value, low and high (95 % interval), unit."""
        import pandas as pd

        check_is_fitted(self, "model_")
        rows = {
            name: {"value": p.value, "low": p.low, "high": p.high, "unit": p.unit}
            for name, p in self.model_.parameters.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "low", "high", "unit"])

    def to_frame(self) -> pd.DataFrame:
        """Return the coefficients; other results have their table under this name."""
        return self.coefficients()

    def plot(self) -> Figure:
        """Plot the rms of each model that the search tried against its number of terms; mark the chosen
        one.
        """
        from matplotlib.figure import Figure

        check_is_fitted(self, "discovery_")
        path = self.discovery_.report["path"]
        searched = list(dict.fromkeys(tuple(point["outputs"]) for point in path))
        figure = Figure(figsize=(5, 3 * len(searched)), layout="constrained")
        panels = figure.subplots(len(searched), 1, squeeze=False)[:, 0]
        for axes, outputs in zip(panels, searched, strict=True):
            points = sorted((p for p in path if tuple(p["outputs"]) == outputs), key=lambda p: p["terms"])
            for key, label in (("left_out_rms", "on data left out"), ("fit_rms", "on data fitted")):
                errors = [np.nan if p.get(key) is None else p[key] for p in points]
                axes.plot([p["terms"] for p in points], errors, "o-", label=label)
            for chosen in (p["terms"] for p in points if p["chosen"]):
                axes.axvline(chosen, color="0.6", ls=":", label="chosen")
            axes.set(title=", ".join(outputs), xlabel="terms", ylabel="rms [reading noise]", yscale="log")
        panels[0].legend(fontsize="small")
        return figure

    def equations(self) -> list[str]:
        """Return the equations of the model: a line for each state and output."""
        check_is_fitted(self, "model_")
        return equations(self.model_)

    def summary(self) -> str:
        """Return a page of text: equations, parameters with intervals, the cost of each term, and bounds that
        bind.
        """
        table = self.coefficients()
        lines = ["Equations", *(f"  {line}" for line in self.equations()), "", "Parameters (95 % interval)"]
        for name, p in self.model_.parameters.items():
            known = p.low is not None and p.high is not None
            interval = f"[{p.low:.4g}, {p.high:.4g}]" if known else "fixed" if p.fixed else "not determined"
            unit = "" if p.unit == "1" else f" {p.unit}"
            lines.append(
                f"  {name:<{max(map(len, table.index), default=0)}}  {p.value:.5g}{unit}  {interval}"
            )
        lines += ["", "Terms: increase of the rms on left-out data without each one"]
        for group in self.discovery_.report["groups"]:
            of = ", ".join(group["outputs"])
            lines.append(f"  {of}: rms on left-out data {group['left_out_rms']:.4g} times the reading noise")
            lines += [f"    {label}  {100 * cost:+.1f} %" for label, cost in group.get("costs", {}).items()]
        if binding := self.discovery_.report["binding"]:
            lines += ["", "Bounds that bind", *(f"  {one}" for one in binding)]
        return "\n".join(lines)

    def _options(self) -> SparseOptions:
        from pydantic import ValidationError

        own = {k: v for k, v in self.get_params(deep=False).items() if k not in ("channels", "step")}
        given = {k: v for k, v in own.items() if v is not None}
        library = given.get("library", ())
        if isinstance(library, str) or not (isinstance(library, Sequence) and all(map(_is_text, library))):
            raise UserError(
                "library: name families or expressions as texts, as in ['linear', 'sqrt', 'y*u']; a library "
                "of PySINDy works in a SINDy of your own, with our SparseSearch (docs/discovery.md)"
            )
        try:
            return SparseOptions.model_validate(given)
        except ValidationError as error:
            what = error.errors(include_url=False)[0]
            raise UserError(
                f"{'.'.join(str(k) for k in what['loc'])}: {what['msg'].removeprefix('Value error, ')}"
            ) from None

    def _campaign(self, x: pd.DataFrame, z: pd.DataFrame) -> Campaign:
        import pandas as pd

        said = self.channels or {}
        channels = {c: said.get(c, INPUT) for c in self.inputs_} | {
            c: said.get(c, OUTPUT) for c in self.outputs_
        }
        both = pd.concat([x.set_axis(self.inputs_, axis=1), z.set_axis(self.outputs_, axis=1)], axis=1)
        return campaign_from_frames(_recordings(both), channels)

    def _run(self, name: str, table: pd.DataFrame, first: Array) -> Array:
        """Free run (T, outputs) at every row of a recording."""
        import pandas as pd

        rows = np.full((len(table), len(self.outputs_)), np.nan)
        rows[0] = first
        z = pd.DataFrame(rows, index=table.index, columns=self.outputs_)
        campaign = self._campaign(_stacked({name: table}), _stacked({name: z}))
        time = campaign.recordings[name].time
        grid = make_grid(
            campaign, name, inputs_of(self.model_, campaign, self.outputs_), self.outputs_, most=10**9
        )
        nodes = np.union1d(grid.time, time)
        readings = np.full((len(time), len(self.outputs_)), np.nan)
        readings[0] = first
        every = replace(grid, time=nodes, read=np.searchsorted(nodes, time), readings=readings)
        run = predict_recording(self.model_, campaign, name, self.outputs_, self.noise_, every)
        return predict(run)


def _first(series: Array) -> float:
    known = series[np.isfinite(series)]
    return float(known[0]) if len(known) else 0.0


def _framed(data: Any, step: float, letter: str) -> pd.DataFrame:
    """Rows as a frame whose index is time, or (recording, time)."""
    import pandas as pd

    if isinstance(data, pd.Series):
        return data.to_frame(name=data.name if data.name is not None else f"{letter}0")
    if isinstance(data, pd.DataFrame):
        return data
    table = np.asarray(data, dtype=float)
    table = table.reshape(len(table), -1)
    names = [f"{letter}{k}" for k in range(table.shape[1])]
    return pd.DataFrame(table, index=step * np.arange(len(table)), columns=names)


def _stacked(frames: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Recordings one below the other, index (recording, time)."""
    import pandas as pd

    return pd.concat(dict(frames), names=["recording", "time"])


def _recordings(table: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """The recordings of a frame by name, in their order."""
    import pandas as pd

    if not isinstance(table.index, pd.MultiIndex):
        return {"recording": table}
    names = list(dict.fromkeys(table.index.get_level_values(0)))
    return {str(name): cast("pd.DataFrame", table.xs(name, level=0)) for name in names}
