"""Discovery end to end on small recordings whose truth is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from discovery.dynamics import make_grid, make_system, predict, simulate
from discovery.errors import UserError
from discovery.fitting import predict_recording
from discovery.models import Model, Parameter, State
from discovery.models.modelfile import read_model, write_model
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.discover import discover
from discovery.sparse.discovery import Discovery
from discovery.sparse.growth import Growth, _exchanged
from discovery.sparse.options import SparseOptions
from discovery.sparse.ratedata import make_rate_data, rough_noise
from discovery.sparse.rates import Candidate, with_candidates
from discovery.terms import Number, Term, parse

Array = NDArray[np.float64]

CHANNELS = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "T_fluid": Channel("T_fluid", "fluid temperature", "degC", None, "linear"),
    "pump": Channel("pump", "fluid flow", "1", None, "held"),
    "P": Channel("P", "heat load", "W", None, "held"),
    "E": Channel("E", "error", "um", 0.1, "linear"),
}
LIBRARY = ("y", "1", "T_env", "T_fluid", "P", "pump", "pump*T_fluid", "pump*y", "(P/100)**2", "pump*P")


def steps(rng: np.random.Generator, time: Array, hours: float, levels: tuple[float, ...]) -> Array:
    index = (time // (hours * 3600)).astype(int)
    return np.asarray(rng.choice(levels, index.max() + 1)[index], dtype=np.float64)


def make_campaign(truth: Model, names: tuple[str, ...], hours: float = 36.0) -> Campaign:
    """Recordings of a model: inputs every 2 minutes, readings every 8 to 16 minutes with 0.1 um noise."""
    rng = np.random.default_rng(7)
    time = np.arange(0.0, hours * 3600 + 1, 120.0)
    made = {}
    for name in names:
        phase = rng.uniform(0, 6)
        values = {
            "T_env": 22 + np.sin(time / 13000 + phase) + 0.5 * np.sin(time / 5000),
            "T_fluid": 26 + 2 * np.sin(time / 9000 + 2 * phase),
            "pump": steps(rng, time, 2.5, (0.0, 1.0)),
            "P": steps(rng, time, 1.5, (0.0, 100.0, 250.0)),
            "E": np.full(len(time), np.nan),
        }
        read = np.concatenate([[0], np.cumsum(rng.integers(4, 9, len(time)))])
        read = read[read < len(time)]
        values["E"][read] = 0.0
        campaign = Campaign("test", CHANNELS, {name: Recording(name, time, values)}, Path("test"))
        trajectory = simulate(
            make_system(truth, make_grid(campaign, name, truth.inputs, ["E"])), truth.values()
        )
        values["E"][read] = predict(trajectory)[:, 0] + 0.1 * rng.standard_normal(len(read))
        made[name] = Recording(name, time, values)
    return Campaign("test", CHANNELS, made, Path("test"))


@pytest.fixture(scope="module")
def gated() -> Campaign:
    """y' = -0.5 y + 0.05 P + 1.2 pump (T_fluid - 26), per hour."""
    rates = {"E": State("E", "um", None, Number(0.0), 0.0, 1 / 3600)}
    terms = (
        Term("own", "E", parse("-0.5*E")),
        Term("load", "E", parse("0.05*P")),
        Term("fluid", "E", parse("1.2*pump*(T_fluid - 26)")),
    )
    return make_campaign(Model("truth", {}, rates, terms, {}, "h"), ("a", "b", "c"))


@pytest.fixture(scope="module")
def found(gated: Campaign) -> Discovery:
    return discover(gated, ["a", "b"], ["E"], SparseOptions(form="rates", library=LIBRARY, bootstraps=10))


def coefficients(discovery: Discovery) -> dict[str, float]:
    model = discovery.model
    return {
        term.name.removesuffix(" in E").replace("E", "y"): next(
            p.value for name, p in model.parameters.items() if f"'{name}'" in str(term.expression)
        )
        for term in model.terms
    }


def test_the_exact_terms_are_found_with_their_coefficients(found: Discovery) -> None:
    sizes = coefficients(found)
    assert set(sizes) == {"y", "P", "pump", "pump*T_fluid"}
    assert sizes["y"] == pytest.approx(-0.5, rel=0.03)
    assert sizes["P"] == pytest.approx(0.05, rel=0.03)
    assert sizes["pump*T_fluid"] == pytest.approx(1.2, rel=0.05)


def test_the_report_holds_path_and_stability(found: Discovery) -> None:
    assert [point.terms for point in found.path] == sorted(point.terms for point in found.path)
    assert sum(point.chosen for point in found.path) == 1
    assert min(found.stability.values()) >= 0.8
    assert found.report["groups"][0]["terms"] == 4


def test_nothing_but_the_recordings_to_fit_is_seen(gated: Campaign, found: Discovery) -> None:
    c = gated.recordings["c"]
    spoilt = replace(c, values={name: series * np.nan for name, series in c.values.items()})
    again = discover(
        replace(gated, recordings={**gated.recordings, "c": spoilt}),
        ["a", "b"],
        ["E"],
        SparseOptions(form="rates", library=LIBRARY, bootstraps=10),
    )
    assert again.model == found.model  # and the search is deterministic
    assert again.stability == found.stability


def test_bounds_and_signs_are_respected(gated: Campaign) -> None:
    options = SparseOptions(
        form="rates", library=LIBRARY, bounds={"P": (0.0, 0.02), "pump*T_fluid": (-1.0, 0.0)}, bootstraps=0
    )
    sizes = coefficients(discover(gated, ["a", "b"], ["E"], options))
    assert sizes.get("P", 0.0) <= 0.02 + 1e-9
    assert sizes.get("pump*T_fluid", 0.0) <= 0.0


def test_masses_predict_a_recording_that_was_left_out(gated: Campaign, tmp_path: Path) -> None:
    discovery = discover(gated, ["a", "b"], ["E"], SparseOptions(bootstraps=0))
    write_model(tmp_path / "model.toml", discovery.model)
    model = read_model(tmp_path / "model.toml")
    trajectory = predict_recording(model, gated, "c", ["E"])
    left = trajectory.system.grid.readings - predict(trajectory)
    assert np.sqrt(np.mean(left**2)) < 0.2  # noise 0.1, the errors some 10 um
    assert all(p.low is not None for p in discovery.model.parameters.values())


def test_one_recording_is_enough(gated: Campaign) -> None:
    discovery = discover(gated, ["a"], ["E"], SparseOptions(bootstraps=0))
    trajectory = predict_recording(discovery.model, gated, "c", ["E"])
    assert np.sqrt(np.mean((trajectory.system.grid.readings - predict(trajectory)) ** 2)) < 1.0


@pytest.mark.parametrize(
    ("optimiser", "arguments"),
    [("STLSQ", {"threshold": 0.02, "alpha": 1e-8}), ("SR3", {"reg_weight_lam": 1e-4, "regularizer": "L0"})],
)
def test_the_optimisers_of_pysindy_serve_too(
    gated: Campaign, optimiser: str, arguments: dict[str, float | str]
) -> None:
    options = SparseOptions(
        form="rates",
        library=LIBRARY,
        optimiser=f"pysindy:{optimiser}",
        optimiser_arguments=arguments,
        bootstraps=0,
    )
    assert {"y", "P", "pump*T_fluid"} <= set(coefficients(discover(gated, ["a", "b"], ["E"], options)))


def test_a_baseline_file_gets_the_term_that_it_lacks(tmp_path: Path) -> None:
    body = State("body", "degC", 50e3, parse("T_env"), 0.5, 1 / 50e3)
    full = Model(
        "body",
        {
            "hA": Parameter(10.0, "W/K", 0.0),
            "loss": Parameter(1.0, "1", 0.0),
        },
        {"body": body},
        (Term("air", "body", parse("hA*(T_env - body)")), Term("load", "body", parse("loss*P"))),
        {"E": parse("3*(body - 22)")},
    )
    truth = full.with_terms(Term("fluid", "body", parse("25*pump*(T_fluid - body)")))
    campaign = make_campaign(truth, ("a", "b"))
    write_model(tmp_path / "body.toml", full)
    options = SparseOptions(baseline="body.toml", bootstraps=0)
    discovery = discover(campaign, ["a", "b"], ["E"], options, folder=tmp_path)
    assert discovery.report["groups"][0]["kept"] == ["body: pump*(T_fluid - body)"]
    assert discovery.model.parameters["body_p1"].value == pytest.approx(25, rel=0.05)
    assert discovery.model.parameters["hA"].value == pytest.approx(10, rel=0.05)


def test_a_term_that_entered_in_place_of_another_gives_way() -> None:
    """Wet load stands in for the fluid where the baseline is bent enough; fitted together, it does not."""
    body = State("body", "degC", 50e3, parse("T_env"), 0.5, 1 / 50e3)
    parameters = {"hA": Parameter(10.0, "W/K", 0.0), "loss": Parameter(1.0, "1", 0.0)}
    terms = (Term("air", "body", parse("hA*(T_env - body)")), Term("load", "body", parse("loss*P")))
    baseline = Model("body", parameters, {"body": body}, terms, {"E": parse("3*(body - 22)")})
    truth = baseline.with_terms(Term("fluid", "body", parse("25*pump*(T_fluid - body)")))
    data = make_rate_data(make_campaign(truth, ("a", "b")), ["a", "b"], ["E"], list(CHANNELS)[:4], 24)
    offered = [Candidate("body", parse(one)) for one in ("pump*P", "pump", "pump*(T_fluid - body)")]
    model, labels = with_candidates(baseline, offered)
    growth, noise = Growth(restart=baseline.values()), rough_noise(data)
    for first in (["body_p1"], ["body_p1", "body_p2"], ["body_p3"]):
        found, entered = _exchanged(data, model, labels, first, growth, noise, SparseOptions())
        assert entered == ["body_p3"]
        assert found.parameters["body_p3"].value == pytest.approx(25, rel=0.05)
        assert found.parameters["body_p1"].value == found.parameters["body_p2"].value == 0.0


def test_two_measured_temperatures_are_found_to_be_coupled() -> None:
    channels = {
        "q1": Channel("q1", "heat load", "W", None, "held"),
        "q2": Channel("q2", "heat load", "W", None, "held"),
        "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
        "T1": Channel("T1", "temperature", "degC", None, "linear"),
        "T2": Channel("T2", "temperature", "degC", None, "linear"),
    }
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 6000.0, 10.0)
    a, c = 15 / 3600, 8 / 3600  # 1/s: to the room, to each other
    made = {}
    for name in ("a", "b", "c"):
        q = np.column_stack([steps(rng, time, 0.15, (0.0, 40.0, 80.0)) for _ in range(2)])
        body, sensor = np.full((len(time), 2), 23.0), np.full((len(time), 2), 23.0)
        for k in range(len(time) - 1):
            b, s = body[k], sensor[k]
            for _ in range(10):
                b, s = b + a * (23 - b) + c * (b[::-1] - b) + 0.006 * q[k], s + (b - s) / 20
            body[k + 1], sensor[k + 1] = b, s
        sensor += 0.05 * rng.standard_normal(sensor.shape)
        values = {
            "q1": q[:, 0],
            "q2": q[:, 1],
            "T_env": 0 * time + 23,
            "T1": sensor[:, 0],
            "T2": sensor[:, 1],
        }
        made[name] = Recording(name, time, values)
    campaign = Campaign("two", channels, made, Path("two"))
    options = SparseOptions(library=("linear", "coupling"), bootstraps=0)
    discovery = discover(campaign, ["a", "b"], ["T1", "T2"], options)
    kept = discovery.report["groups"][0]["kept"]
    assert "T1_body: T2_body - T1_body" in kept
    assert "T2_body: T1_body - T2_body" in kept
    assert discovery.model.parameters["T1_lag"].value == pytest.approx(20, rel=0.2)
    trajectory = predict_recording(discovery.model, campaign, "c", ["T1", "T2"])
    assert np.sqrt(np.mean((trajectory.system.grid.readings - predict(trajectory)) ** 2)) < 0.2


def test_a_users_mistakes_are_named(gated: Campaign) -> None:
    with pytest.raises(ValidationError, match="max_term"):
        SparseOptions.model_validate({"kind": "sindy", "max_term": 3})
    with pytest.raises(ValidationError, match="the shorter one first"):
        SparseOptions(time_constants=(600.0, 300.0))
    with pytest.raises(UserError, match="no optimiser STLQS"):
        discover(gated, ["a"], ["E"], SparseOptions(optimiser="pysindy:STLQS"))
    with pytest.raises(UserError, match="optimiser_arguments"):
        discover(gated, ["a"], ["E"], SparseOptions(optimiser="pysindy:SR3", optimiser_arguments={"x": 1}))
    with pytest.raises(UserError, match="'T_air', which is not a channel"):
        discover(gated, ["a"], ["E"], SparseOptions(inputs=("T_air",)))
    with pytest.raises(UserError, match="cannot drive"):
        discover(gated, ["a"], ["E"], SparseOptions(inputs=("E",)))
    with pytest.raises(UserError, match="'velocity'"):
        discover(gated, ["a"], ["E"], SparseOptions(library=("velocity**2",)))
    with pytest.raises(UserError, match="not a term of its library"):
        discover(gated, ["a"], ["E"], SparseOptions(form="rates", library=("P",), bounds={"pump": (0, 1)}))
