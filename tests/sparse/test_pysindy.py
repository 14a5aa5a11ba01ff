"""PySINDy is the frame: our library and optimiser in a SINDy of the user's, and his optimiser in ours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pysindy
import pytest
from numpy.typing import NDArray

from discovery.experiment import load_experiment
from discovery.experiment.form import ExperimentForm
from discovery.experiment.modelfits import starting_model
from discovery.files import read_toml
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.discover import discover
from discovery.sparse.library import FilteredInputs
from discovery.sparse.optimiser import SparseSearch
from discovery.sparse.options import SparseOptions
from discovery.sparse.plain import TEST_FUNCTIONS, Table, _weak_rows, fit_plain, settings

Array = NDArray[np.float64]
STEP, COUNT = 120.0, 1200


def loads(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return np.column_stack([np.repeat(rng.choice([0.0, 100.0, 250.0], 40), 30) for _ in range(3)])


def lag(u: Array, tau: float) -> Array:
    decay, s, out = np.exp(-STEP / tau), 0.0, []
    for one in u:
        out.append(s)
        s = one + decay * (s - one)
    return np.array(out)


def tables(seed: int) -> tuple[Array, Array]:
    """E_Y = 0.02 of P0 at 3600 s; E_Z = 0.03 of P1 at 7200 s and 0.01 of P2 at 1800 s; 0.1 um."""
    u = loads(seed)
    y = np.column_stack(
        [0.02 * lag(u[:, 0], 3600.0), 0.03 * lag(u[:, 1], 7200.0) + 0.01 * lag(u[:, 2], 1800.0)]
    )
    noise = 0.1 * np.random.default_rng(seed + 100).standard_normal(y.shape)
    return np.column_stack([STEP * np.arange(COUNT), u]), y + noise


def made() -> Campaign:
    channels = {f"P{k}": Channel(f"P{k}", "heat load", "W", None, "held") for k in range(3)}
    channels |= {y: Channel(y, "error", "um", 0.1, "linear") for y in ("E_Y", "E_Z")}
    recordings = {}
    for name, seed in (("a", 0), ("b", 1)):
        x, y = tables(seed)
        values = {f"P{k}": x[:, k + 1] for k in range(3)} | {"E_Y": y[:, 0], "E_Z": y[:, 1]}
        recordings[name] = Recording(name, x[:, 0], values)
    return Campaign("masses", channels, recordings, Path("masses"))


def test_our_library_and_search_serve_in_a_sindy_of_the_user() -> None:
    (x_a, y_a), (x_b, y_b) = tables(0), tables(1)
    library = FilteredInputs(["time", "P0", "P1", "P2"])
    model = pysindy.SINDy(optimizer=SparseSearch(library), feature_library=library)
    model.fit([x_a, x_b], t=1, x_dot=[y_a, y_b])
    used = [
        {name.split(",")[0] for name, c in zip(model.get_feature_names(), row, strict=True) if c}
        for row in model.coefficients()
    ]
    assert used[0] - {"1"} == {"lag(P0"}
    assert used[1] - {"1"} == {"lag(P1", "lag(P2"}
    assert model.score(x_a, t=1, x_dot=y_a) > 0.99


def test_an_optimiser_of_pysindy_serves_with_our_library() -> None:
    x, y = tables(0)
    library = FilteredInputs(["time", "P0", "P1", "P2"], time_constants=(1800.0, 7200.0))
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=1e-3, alpha=1e-6), feature_library=library)
    model.fit([x], t=1, x_dot=[y])
    assert model.score(x, t=1, x_dot=y) > 0.95


def test_every_discovery_is_made_by_pysindy(monkeypatch: pytest.MonkeyPatch) -> None:
    optimisers: list[Any] = []
    original = pysindy.SINDy.fit

    def spied(self: Any, *given: Any, **named: Any) -> Any:
        optimisers.append(self.optimizer)
        return original(self, *given, **named)

    monkeypatch.setattr(pysindy.SINDy, "fit", spied)
    found = discover(made(), ["a", "b"], ["E_Y", "E_Z"], SparseOptions(bootstraps=0))
    assert [type(one) for one in optimisers] == [SparseSearch, SparseSearch]
    kept = [{k.split(",")[0] for k in g["kept"]} - {"1"} for g in found.report["groups"]]
    assert kept == [{"lag(P0"}, {"lag(P1", "lag(P2"}]
    assert all(cost > 0 for g in found.report["groups"] for cost in g["costs"].values())
    for name, p in found.model.parameters.items():
        assert p.low is not None
        assert p.high is not None
        assert not p.low <= 0 <= p.high, name


def test_the_demonstrations_reach_it() -> None:
    for path in Path("experiments").glob("*.toml"):
        if path.name in ("nmv5000.toml", "tclab.toml", "tanks.toml"):
            kinds = [entry.kind for entry in read_toml(path, ExperimentForm).models.values()]
            assert {"sindy", "pysindy", "regression"} <= set(kinds)


@pytest.mark.parametrize(
    ("name", "outputs", "term"),
    [
        ("black_box", ("E_Z0T", "E_R0T"), "lag(P_drive, "),
        ("discovered", ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C"), "pump*(T_fluid - table)"),
    ],
)
def test_what_the_demonstration_discovers_comes_out_of_pysindy(
    monkeypatch: pytest.MonkeyPatch, name: str, outputs: tuple[str, ...], term: str
) -> None:
    coefficients: list[Array] = []
    original = pysindy.SINDy.fit

    def spied(self: Any, *given: Any, **named: Any) -> Any:
        fitted = original(self, *given, **named)
        coefficients.append(np.asarray(self.coefficients()))
        return fitted

    monkeypatch.setattr(pysindy.SINDy, "fit", spied)
    experiment = replace(load_experiment(Path("experiments/nmv5000.toml")), outputs=outputs)
    entry = experiment.form.models[name].model_copy(update={"bootstraps": 0})
    _, report = starting_model(experiment.seen_by(entry), name, entry)
    assert report is not None
    groups = report["groups"]
    assert any(term in kept for group in groups for kept in group["kept"])
    counts = [int(np.count_nonzero(found)) for found in coefficients]
    if name == "discovered":  # the one fit that ends the growth
        assert counts[-1] >= len(groups[0]["kept"])
        return
    for group in groups:  # one of the fits of each output: recordings that begin cold, or warm
        sizes = [p["terms"] for p in report["path"] if p["chosen"] and p["outputs"] == group["outputs"]]
        assert len(group["kept"]) <= sizes[0]
        assert sizes[0] in counts


def test_constraints_are_lines_of_the_experiment() -> None:
    def terms(**said: Any) -> list[str]:
        options = SparseOptions.model_validate({"bootstraps": 0, "form": "masses", **said})
        return list(discover(made(), ["a", "b"], ["E_Z"], options).report["groups"][0]["kept"])

    assert not any("P2" in one for one in terms(forbid=["P2"]))
    assert not any("P1" in one for one in terms(bounds={"P1": [float("-inf"), 0.0]}))
    assert any("P0" in one for one in terms(keep=["P0"]))


@pytest.mark.filterwarnings("ignore::pysindy.utils._axes.AxesWarning")
@pytest.mark.parametrize("degree", [1, 2])
def test_weak_rows_are_those_of_the_library(degree: int) -> None:
    """Bit for bit; its domains on a grid of times are drawn once for all degrees and signals."""
    rng, time = np.random.default_rng(degree), np.linspace(0.0, 3.0, 300)
    table = Table(time, rng.normal(size=(300, 2)), rng.normal(size=(300, 1)))
    both = pysindy.AxesArray(np.column_stack([table.x, table.u]), {"ax_time": 0, "ax_coord": 1})
    np.random.seed(7)  # noqa: NPY002
    functions = pysindy.PolynomialLibrary(degree=degree, include_bias=True)
    weak = pysindy.WeakPDELibrary(functions, spatiotemporal_grid=time, K=TEST_FUNCTIONS)
    theta, target = weak.fit([both]).transform([both])[0], weak.convert_u_dot_integral(table.x)
    found = _weak_rows(table, degree, 7)
    np.testing.assert_array_equal(found[0], np.asarray(theta))
    np.testing.assert_array_equal(found[1], np.asarray(target))
    assert np.abs(_weak_rows(replace(table), degree, 8)[0] - found[0]).max() > 0.0


@pytest.mark.parametrize("form", ["plain", "weak"])
def test_pysindy_as_its_users_take_it_finds_a_single_mass(form: str) -> None:
    """E_Y is of the first order in its own rate, what PySINDy can say."""
    fit, setting, report = fit_plain(made(), ["a", "b"], ["E_Y"], ["P0", "P1", "P2"], settings(form))
    assert (setting.weak, report["form"]) == (form == "weak", form)
    readings = np.concatenate([t.system.grid.readings for t in fit.trajectories])
    left = np.concatenate(list(fit.residuals().values()))
    assert np.sqrt(np.mean(left**2)) < 0.5 * np.std(readings)


def test_readings_in_bursts_are_not_torn_apart() -> None:
    """Three readings, 4 s apart, then a pause of 52 s: as a probe that is pressed thrice."""
    burst = np.concatenate([60.0 * k + np.array([0.0, 4.0, 8.0]) for k in range(90)])
    level = 3.0 * (1.0 - np.exp(-burst / 900.0))
    fit, _, _ = fit_plain(_one(burst, level), ["a"], ["E"], ["P"], settings("plain"))
    left = np.concatenate(list(fit.residuals().values()))
    assert fit.model.terms
    assert np.sqrt(np.mean(left**2)) < 0.1 * np.std(level)


def test_readings_too_few_for_a_derivative_leave_no_term() -> None:
    few = np.arange(0.0, 900.0, 60.0)
    fit, _, report = fit_plain(_one(few, few / 300.0), ["a"], ["E"], ["P"], settings())
    assert fit.model.terms == ()
    assert report["left_out_rms"] > 1.0


def _one(time: Array, level: Array) -> Campaign:
    """A heat load that is switched on at the start, and an error that follows it."""
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "E": Channel("E", "error", "um", 0.01, "linear"),
    }
    values = {"P": np.full(time.size, 100.0), "E": level}
    return Campaign("one", channels, {"a": Recording("a", time, values)}, Path("one"))
