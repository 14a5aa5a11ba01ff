"""Equations (7) to (9) and their parameters recovered from data that scipy made."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.fitting import fit_model, predict_recording
from discovery.fitting.sequential import fit_one_at_a_time
from discovery.fitting.starts import warm_start
from discovery.models.reduced import reduced
from discovery.models.superposition import superposition
from discovery.recordings import Campaign, Channel, Recording

Array = NDArray[np.float64]
HOUR = 3600.0
INPUTS = ["T_env", "P", "T_fluid"]
CHANNELS = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "P": Channel("P", "heat load", "W", None, "held"),
    "T_fluid": Channel("T_fluid", "fluid temperature", "degC", None, "linear"),
    "E": Channel("E", "error", "um", 0.5, "linear"),
}


def inputs(
    seed: int, hours: float = 48.0, on: tuple[str, ...] = ("T_env", "P", "T_fluid")
) -> tuple[Array, dict[str, Array]]:
    """Stamps every 5 minutes; temperatures with hourly knots, power switched every half hour; what is not
    `on` rests.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, hours * HOUR + 1, 300.0)
    knots = np.arange(0.0, hours + 1)
    walk = np.interp(time / HOUR, knots, 22 + np.cumsum(rng.normal(0, 0.3, len(knots))))
    fluid = np.interp(time / HOUR, knots, 25 + np.cumsum(rng.normal(0, 0.5, len(knots))))
    power = rng.choice([0.0, 200.0, 600.0, 1100.0], int(hours * 2) + 1)[(time / 1800).astype(int)]
    return time, {
        "T_env": walk if "T_env" in on else np.full(len(time), 22.0),
        "P": power if "P" in on else np.zeros(len(time)),
        "T_fluid": fluid if "T_fluid" in on else np.full(len(time), 25.0),
    }


def solved(
    time: Array, u: dict[str, Array], pole: float, gains: dict[str, float], constant: float, start: float
) -> Array:
    """y' = pole y + sum gain u + constant, in hours, by LSODA from stamp to stamp of the power."""

    def rate(t: float, y: Array, power: float) -> Array:
        straight = sum(gains.get(n, 0.0) * np.interp(t, time, u[n]) for n in ("T_env", "T_fluid"))
        return np.asarray((pole * y + straight + gains.get("P", 0.0) * power + constant) / HOUR)

    y, out = np.array([start]), [start]
    for k in range(0, len(time) - 1, 6):
        stamps = time[k : k + 7]
        part = solve_ivp(
            rate, (stamps[0], stamps[-1]), y, "LSODA", stamps[1:], args=(u["P"][k],), rtol=1e-8, atol=1e-8
        )
        y = part.y[:, -1]
        out += part.y[0].tolist()
    return np.array(out)


def read(time: Array, y: Array, noise: float, seed: int) -> Array:
    """Readings at irregular stamps, 5 to 15 minutes apart."""
    rng = np.random.default_rng(seed)
    taken = np.cumsum(rng.integers(1, 4, len(time)))
    out = np.full(len(time), np.nan)
    taken = np.concatenate([[0], taken[taken < len(time)]])
    out[taken] = y[taken] + rng.normal(0, noise, len(taken))
    return out


def one_cycle(noise: float) -> Campaign:
    recordings = {}
    for seed, name in enumerate(("fit", "other")):
        time, u = inputs(seed)
        y = solved(time, u, -0.35, {"T_env": -1.1, "P": -0.014, "T_fluid": -0.6}, 40.0, 2.0)
        recordings[name] = Recording(name, time, {**u, "E": read(time, y, noise, seed)})
    return Campaign("c", CHANNELS, recordings)


TRUTH = {"p1_E": -0.35, "p2_E": -1.1, "p3_E": -0.014, "p4_E": -0.6, "p5_E": 40.0}


def test_equation_9_from_its_own_data_without_noise() -> None:
    campaign = one_cycle(0.0)
    model = warm_start(reduced(INPUTS, ["E"], CHANNELS), campaign, ["fit"], ["E"])
    fitted = fit_model(model, campaign, ["fit"]).model
    for name, value in TRUTH.items():
        assert fitted.parameters[name].value == pytest.approx(value, rel=1e-3), name
    left = fit_model(model, campaign, ["fit"]).problem.residual(
        predict_recording(fitted, campaign, "other", ["E"])
    )
    assert np.nanmax(np.abs(left)) < 1e-3


def test_equation_9_with_noise_lies_in_its_intervals() -> None:
    campaign = one_cycle(0.5)
    model = warm_start(reduced(INPUTS, ["E"], CHANNELS), campaign, ["fit"], ["E"])
    fitted = fit_model(model, campaign, ["fit", "other"]).model
    for name, value in TRUTH.items():
        p = fitted.parameters[name]
        assert p.low is not None
        assert p.high is not None
        middle, half = (p.low + p.high) / 2, (p.high - p.low) / 2
        assert abs(value - middle) < 1.6 * half  # three standard errors
        assert half < 0.35 * abs(value)


def test_the_fit_does_not_need_a_good_start() -> None:
    """From two hours and no influence, and from the regression on filtered inputs, to the same minimum."""
    campaign = one_cycle(0.5)
    generic = reduced(INPUTS, ["E"], CHANNELS)
    costs = [
        fit_model(m, campaign, ["fit"]).cost for m in (generic, warm_start(generic, campaign, ["fit"], ["E"]))
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-3)


def test_an_influence_that_only_drifts_is_kept_from_running_away() -> None:
    """Two days of a trend: as an integrator of the room it would go on for ever in the next recording."""
    time, u = inputs(3)
    trend = Recording("fit", time, {**u, "E": read(time, 0.2 * time / HOUR, 0.1, 3)})
    campaign = Campaign("c", CHANNELS, {"fit": trend})
    model = warm_start(superposition(INPUTS, ["E"], CHANNELS), campaign, ["fit"], ["E"])
    fitted = fit_model(model, campaign, ["fit"]).model
    poles = [fitted.parameters[f"p{k}_E"].value for k in (1, 4, 7)]
    assert max(poles) <= -1 / 16 + 1e-9  # a third of 48 h
    assert max(poles) == pytest.approx(-1 / 16)  # where it wants to go further


def separate_runs(
    starts: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> tuple[Campaign, dict[str, dict[str, float]]]:
    """The truth is eq. (8): three influences with poles of their own, each recorded alone, then all together.

    The machine starts at rest, the fluid at the reference temperature of 20 degC. `starts`: what
    is left in each recording of a room that was warmer or colder before.
    """
    truth = {
        "T_env": {"pole": -0.08, "gain": -0.25, "zero": -22.0},
        "P": {"pole": -0.9, "gain": -0.03, "zero": 0.0},
        "T_fluid": {"pole": -0.4, "gain": -0.8, "zero": -20.0},
    }
    recordings = {}
    runs = {"room": ("T_env",), "load": ("P",), "fluid": ("T_fluid",), "all": ("T_env", "P", "T_fluid")}
    for seed, (name, on) in enumerate(runs.items()):
        time, u = inputs(seed + 10, 72.0, on)
        for one in ("T_env", "T_fluid"):
            u[one] = u[one] - u[one][0] - truth[one]["zero"]
        y = sum(
            solved(time, u, t["pole"], {c: t["gain"]}, t["gain"] * t["zero"], starts[seed] * (c == "T_env"))
            for c, t in truth.items()
        )
        recordings[name] = Recording(name, time, {**u, "E": read(time, np.asarray(y), 0.1, seed)})
    return Campaign("c", CHANNELS, recordings), truth


@pytest.mark.parametrize("starts", [(0.0, 0.0, 0.0, 0.0), (-12.0, 9.0, 6.0, -7.0)])
def test_equation_8_one_influence_at_a_time(starts: tuple[float, float, float, float]) -> None:
    campaign, truth = separate_runs(starts)
    model = fit_one_at_a_time(campaign, {"T_env": ["room"], "T_fluid": ["fluid"], "P": ["load"]}, ["E"])
    for k, channel in enumerate(("T_env", "T_fluid", "P")):
        pole, gain, zero = (model.parameters[f"p{3 * k + j}_E"] for j in (1, 2, 3))
        assert pole.value == pytest.approx(truth[channel]["pole"], rel=0.05)
        assert gain.value == pytest.approx(truth[channel]["gain"], rel=0.05)
        assert zero.value == pytest.approx(truth[channel]["zero"], abs=5.0 if channel == "P" else 0.3)
        assert pole.low is not None
        assert pole.fixed
    residual = campaign.recordings["all"].values["E"]
    fit = fit_model(model, campaign, ["all"])
    left = fit.problem.residual(predict_recording(model, campaign, "all", ["E"]))
    assert np.sqrt(np.nanmean(left**2)) < 0.1 * np.nanstd(residual)


def test_known_influences_are_compensated_before_the_next() -> None:
    """The load is identified from a run in which room and fluid move, too."""
    campaign, truth = separate_runs()
    model = fit_one_at_a_time(campaign, {"T_env": ["room"], "T_fluid": ["fluid"], "P": ["all"]}, ["E"])
    assert model.parameters["p7_E"].value == pytest.approx(truth["P"]["pole"], rel=0.05)
    assert model.parameters["p8_E"].value == pytest.approx(truth["P"]["gain"], rel=0.05)


def test_equation_8_jointly_finds_three_poles() -> None:
    campaign, truth = separate_runs()
    model = warm_start(superposition(INPUTS, ["E"], CHANNELS), campaign, ["all"], ["E"])
    fitted = fit_model(model, campaign, ["all"]).model
    for k, channel in enumerate(INPUTS):
        assert fitted.parameters[f"p{3 * k + 1}_E"].value == pytest.approx(truth[channel]["pole"], rel=0.1)
        assert fitted.parameters[f"p{3 * k + 2}_E"].value == pytest.approx(truth[channel]["gain"], rel=0.1)
