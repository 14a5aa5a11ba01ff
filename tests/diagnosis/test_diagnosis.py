"""Whole diagnoses of a machine that scipy simulated: what is concealed is found, and nothing else is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from discovery.diagnosis import Diagnosis, diagnose
from discovery.dynamics import predict
from discovery.fitting import predict_recording
from discovery.models import Model, Parameter, read_model, write_model
from discovery.models.reduced import reduced
from discovery.recordings import Channel, Recording
from discovery.terms import Term, parse
from tests.diagnosis.parts import document
from tests.machine import CHANNELS, NOISE, SEEN, SIZES, Array, Inputs, campaign, changed, model, simulated


@dataclass(frozen=True)
class Case:
    """What is concealed, what the model lacks, and what has to be said of it."""

    verdict: str
    effect: str
    states: tuple[str, ...]
    size: float | None
    model: Callable[[], Model] = model
    heat: Callable[[float, Array, Inputs], tuple[float, float, float]] | None = None
    spoil: Callable[[Recording], Recording] = lambda r: r
    recording: str | None = None


def step(name: str, at: float, size: float) -> Callable[[Recording], Recording]:
    return lambda r: changed(r, **{name: r.values[name] + size * (r.time >= at)})


def rezeroed(r: Recording) -> Recording:
    return changed(r, **{n: r.values[n] + 3.0 * (k + 1) * (r.time >= 40000) for k, n in enumerate(SEEN)})


def drifting(r: Recording) -> Recording:
    return changed(r, E_Z=r.values["E_Z"] + 4.0 * r.time / 86400)


def gap(_: float, x: Array, u: Inputs) -> tuple[float, float, float]:
    heat = 25.0 * u["pump"] * (x[2] - x[0])
    return heat, 0.0, -heat


CASES = {
    "a body that the fluid wets": Case(
        "missing physics", "fluid_convection", ("table",), 30.0, lambda: model(wet=False)
    ),
    "a link": Case("missing physics", "conduction_path", ("table", "bed"), 12.0, lambda: model(linked=False)),
    "a flooded gap": Case("missing physics", "flooded_gap", ("motor", "bed"), 25.0, heat=gap),
    "friction": Case(
        "missing physics",
        "friction_speed",
        ("motor",),
        None,
        heat=lambda _, __, u: (90.0 * (u["speed"] / 1000) ** 2, 0.0, 0.0),
    ),
    "an offset": Case(
        "measurement fault", "sensor_offset", ("E_Z",), 3.0, spoil=step("E_Z", 50000.0, 3.0), recording="r2"
    ),
    "a drift": Case("measurement fault", "sensor_drift", ("E_Z",), 4.0, spoil=drifting, recording="r2"),
    "a device set to zero": Case(
        "measurement fault", "rezero", tuple(SEEN), 3.0, spoil=rezeroed, recording="r2"
    ),
}


@cache
def solved(name: str) -> Diagnosis:
    case = CASES[name]
    one, other, unseen = (simulated(seed, concealed=case.heat) for seed in (1, 2, 3))
    return diagnose(case.model(), campaign(one, case.spoil(other), unseen), ["r1", "r2"], ["r3"])


@pytest.mark.parametrize("name", CASES)
def test_what_is_concealed_is_named(name: str) -> None:
    case, answer = CASES[name], document(solved(name))
    assert answer["verdict"] == case.verdict
    (physics,) = answer["physics"]
    assert physics["effect"] == case.effect
    assert set(physics["states"]) == set(case.states)
    assert physics["recording"] == case.recording
    assert physics["probability"] > 0.9
    assert answer["detection"]["p_value"] < 0.05
    assert answer["detection"]["log_evidence"] > 10.0
    if case.effect == "friction_speed":
        assert next(iter(physics["parameters"].values()))["at"] == "1000 rpm"
    if case.size:
        size = next(iter(physics["parameters"].values()))
        width = size["high"] - size["low"]
        assert size["low"] - width / 2 < case.size < size["high"] + width / 2
        assert size["value"] == pytest.approx(case.size, rel=0.2)


def test_a_size_lies_within_the_intervals_of_both_fits() -> None:
    """That of the diagnosis and that of the model that goes out, which need not agree."""
    found = solved("a flooded gap")
    (h,) = found.verdict.answer.hypotheses
    (size,) = h.amplitudes
    assert found.after is not None
    p = found.after.model.parameters[size]
    low, high = found.interval(h, size)
    own = found.verdict.answer.interval(size)
    assert low is not None
    assert high is not None
    assert own is not None
    assert p.low is not None
    assert p.high is not None
    assert low <= min(own[0], p.low)
    assert high >= max(own[1], p.high)
    assert low < p.value < high
    unsure = SimpleNamespace(  # a model with more effects
        interval=lambda _: (0.5 * low, 2.0 * high), keys=frozenset({"more"}), acts=False
    )
    wider = replace(found, verdict=replace(found.verdict, answer=unsure)).interval(h, size)  # type: ignore[arg-type]
    assert wider[0] is not None
    assert wider[1] is not None
    assert wider[0] <= 0.5 * low
    assert wider[1] >= 2.0 * high
    below = SimpleNamespace(
        interval=lambda _: (-3.0 * high, -2.0 * high), keys=frozenset({"more"}), acts=False
    )
    other = replace(found, verdict=replace(found.verdict, answer=below)).interval(h, size)  # type: ignore[arg-type]
    assert other[0] == max(-3.0 * high, p.min)
    assert other[1] is not None
    assert high <= other[1] < 2.0 * high  # its width, and not as far above as it lies below


def test_a_device_set_to_zero_is_named_where_it_jumps() -> None:
    (physics,) = document(solved("a device set to zero"))["physics"]
    assert physics["moved"] == physics["states"] == list(SEEN)
    assert [p["output"] for p in physics["parameters"].values()] == [*SEEN, None]
    sizes = [p["value"] for p in physics["parameters"].values()][:3]
    assert sizes == pytest.approx([3.0, 6.0, 9.0], abs=0.5)


def test_the_instant_of_a_jump_has_an_interval() -> None:
    """Between two readings nobody knows; this one came at 50000 s."""
    (physics,) = document(solved("an offset"))["physics"]
    _, instant = physics["parameters"].values()
    assert 50000 - 3600 < instant["low"] < 50000 <= instant["high"] < 50000 + 3600


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.recording is None])
def test_the_repair_is_proved_on_what_no_fit_saw(name: str, tmp_path: Path) -> None:
    """The repaired model is a file like any other, and scipy's unseen recording agrees with it."""
    found = solved(name)
    answer = document(found)["improvement"]["held_out"]["r3"]
    assert answer["rms_after"] < 1.1 * NOISE < answer["rms_before"]
    assert answer["gain_low"] > 0
    assert found.explained is not None
    assert found.explained > 0.95
    assert found.repaired is not None
    write_model(tmp_path / "repaired.toml", found.repaired)
    back = read_model(tmp_path / "repaired.toml")
    unseen = simulated(3, concealed=CASES[name].heat)
    free = predict_recording(back, campaign(unseen), "r3", tuple(SEEN), (NOISE,) * 3)
    read = free.system.grid.readings
    assert np.sqrt(np.nanmean((read - predict(free)) ** 2)) == pytest.approx(answer["rms_after"], rel=0.02)


def test_a_window_of_heat_is_found_with_its_body_and_hours() -> None:
    def sun(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
        return (0.0, 0.0, 120.0 * (30000 <= t < 52000))

    runs = simulated(1), simulated(2, concealed=sun)
    answer = diagnose(model(), campaign(*runs), ["r1", "r2"])
    (physics,) = document(answer)["physics"]
    assert (physics["effect"], physics["states"], physics["recording"]) == ("unmeasured_heat", ["bed"], "r2")
    assert next(iter(physics["parameters"].values()))["value"] == pytest.approx(120.0, rel=0.15)
    _, on, off = physics["parameters"].values()
    assert 30000 - 3600 < on["low"] < 30000 < on["high"] < 30000 + 3600
    assert 52000 - 3600 < off["low"] < 52000 < off["high"] < 52000 + 3600
    first_look = [c for c in document(answer)["considered"] if c["effect"] == "unmeasured_heat"]
    assert first_look[0]["recording"] == "r2"
    assert first_look[0]["instants_s"] == pytest.approx([30000, 52000], abs=3600)
    (window,) = answer.location.windows
    assert (window.state, window.recording) == ("bed", "r2")
    assert abs(window.start_s - 30000) < 1800
    assert abs(window.end_s - 52000) < 1800
    # free heat, which knows no catalogue, points to the same place and time
    first = answer.forces[0]
    assert first.state == "bed"
    centre = 0.5 * (first.edges["r2"][1:] + first.edges["r2"][:-1])
    inside = (centre > 32000) & (centre < 50000)
    assert 45.0 < np.mean(first.heat["r2"][inside]) < 130.0  # its prior pulls it to zero
    assert np.abs(first.heat["r2"][(centre < 27000) | (centre > 55000)]).mean() < 30.0
    assert np.abs(first.heat["r1"]).mean() < 15.0


def test_an_event_beside_a_law_needs_a_second_recording() -> None:
    """In the only recording heat for some hours may be what the other law leaves."""

    def sun(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
        return (0.0, 0.0, 120.0 * (30000 <= t < 52000))

    runs = simulated(1), simulated(2, concealed=sun)
    alone = document(diagnose(model(wet=False), campaign(runs[1]), ["r2"]))
    assert "unmeasured_heat" not in {p["effect"] for p in alone["physics"]}
    both = document(diagnose(model(wet=False), campaign(*runs), ["r1", "r2"]))
    assert {p["effect"] for p in both["physics"]} == {"fluid_convection", "unmeasured_heat"}


@pytest.mark.parametrize("size", [-40.0, 15.0, 5.0])
def test_a_single_wrong_reading_is_a_fault_of_the_measuring_chain(size: float) -> None:
    one, other = simulated(1), simulated(2)
    wrong = other.values["E_Z"].copy()
    at = np.flatnonzero(np.isfinite(wrong))[40]
    wrong[at] += size
    found = document(diagnose(model(), campaign(one, changed(other, E_Z=wrong)), ["r1", "r2"]))
    assert found["verdict"] == "measurement fault"
    (fault,) = found["physics"]
    assert (fault["effect"], fault["states"], fault["recording"]) == ("outlier", ["E_Z"], "r2")
    value = next(iter(fault["parameters"].values()))
    assert value["low"] < size < value["high"]
    assert value["value"] == pytest.approx(size, rel=0.2)


@pytest.mark.parametrize(("offs", "said"), [((-40.0,), "a single"), ((-40.0, 15.0), "2 single")])
def test_single_wrong_readings_are_told_next_to_what_is_missing(offs: tuple[float, ...], said: str) -> None:
    one, other = simulated(1), simulated(2)
    wrong = other.values["E_Z"].copy()
    places = np.flatnonzero(np.isfinite(wrong))[[40, 90]]
    for at, off in zip(places, offs, strict=False):
        wrong[at] += off
    found = document(diagnose(model(wet=False), campaign(one, changed(other, E_Z=wrong)), ["r1", "r2"]))
    assert [p["effect"] for p in found["physics"]] == ["fluid_convection"]
    (told,) = (r for r in found["reasons"] if "wrong reading" in r)
    assert told.startswith(said)
    assert f"in 'r2' at {other.time[places[0]]:.0f} s" in told
    (size,) = re.findall(r"E_Z is off by (\S+) um", told)
    assert float(size) == pytest.approx(-40.0, rel=0.2)


def small_heat(seed: int) -> Callable[[float, Array, Inputs], tuple[float, float, float]]:
    """First-order random heat of 3 W rms and three hours at the motor and at the bed."""
    rng = np.random.default_rng(1000 + seed)
    keep = np.exp(-1 / 6)
    walk = rng.standard_normal((200, 2))
    for k in range(1, 200):
        walk[k] = keep * walk[k - 1] + np.sqrt(1 - keep**2) * walk[k]
    return lambda t, _, __: (3.0 * walk[int(t // 1800), 0], 0.0, 3.0 * walk[int(t // 1800), 1])


@pytest.mark.parametrize("usual", [False, True], ids=["white noise", "slow noise and small heat"])
@pytest.mark.parametrize("seed", [11, 21])
def test_nothing_is_named_where_nothing_is_missing(seed: int, usual: bool) -> None:
    runs = [
        simulated(s, slow=0.5 if usual else 0.0, concealed=small_heat(s) if usual else None)
        for s in (seed, seed + 1)
    ]
    answer = document(diagnose(model(), campaign(*runs), [r.name for r in runs]))
    assert answer["verdict"] == "no mismatch"
    assert answer["physics"] == []
    assert answer["improvement"]["explained"] is None
    said = answer["next_experiment"]
    assert "would have shown" in said
    assert re.search(r"fluid_convection of [\d.]+ W/K at any body without fluid, ", said)
    assert re.search(r"friction_speed of [\d.]+ W at 1000 rpm at ", said)
    assert re.search(r"evaporation_drying of [\d.]+ W at any body, ", said)


def without_proof(document: dict[str, Any]) -> dict[str, Any]:
    """A diagnosis without its clock and what is measured, and said, of held-out recordings."""
    kept = {k: v for k, v in document.items() if k != "seconds"}
    reasons = [r for r in kept["reasons"] if "free runs on held-out recordings miss" not in r]
    return {**kept, "improvement": kept["improvement"]["fit"], "reasons": reasons}


def test_held_out_recordings_cannot_influence_the_answer() -> None:
    """Another unseen recording, spoiled beyond recognition: the same answer but for its proof."""
    one, other = simulated(1), simulated(2)
    nonsense = simulated(3)
    noise = np.random.default_rng(0).normal(50, 80, len(nonsense.time))
    nonsense = changed(nonsense, E_Y=nonsense.values["E_Y"] + noise, T_env=nonsense.values["T_env"] + 9)
    found = document(diagnose(model(wet=False), campaign(one, other, nonsense), ["r1", "r2"], ["r3"]))
    expected = document(solved("a body that the fluid wets"))
    assert without_proof(found) == without_proof(expected)
    assert found["improvement"]["held_out"] != expected["improvement"]["held_out"]
    assert len(found["reasons"]) == len(expected["reasons"]) + 1  # one sentence says that r3 is different


def test_the_same_recordings_give_the_same_answer() -> None:
    name = "a drift"
    case = CASES[name]
    runs = simulated(1), case.spoil(simulated(2)), simulated(3)
    again = document(diagnose(model(), campaign(*runs), ["r1", "r2"], ["r3"]))
    first = document(solved(name))
    assert {**again, "seconds": 0} == {**first, "seconds": 0}


def test_two_effects_are_found_together() -> None:
    """The fluid is left out of the model and a gap is flooded: both are named, the larger one first."""
    runs = [simulated(seed, concealed=gap) for seed in (1, 2, 3)]
    found = document(diagnose(model(wet=False), campaign(*runs), ["r1", "r2"], ["r3"]))
    assert found["verdict"] == "missing physics"
    assert {p["effect"] for p in found["physics"]} == {"fluid_convection", "flooded_gap"}
    assert found["improvement"]["explained"] > 0.95


def test_friction_that_ages_is_named_without_a_recorded_power() -> None:
    """Losses that the model reckons from the speed alone, a third less in the second recording."""

    def bearings(watts: float) -> Callable[[float, Array, Inputs], tuple[float, float, float]]:
        return lambda _, __, u: (
            watts * (u["speed"] / 1000) ** 1.5 - SIZES["loss"] * u["P_drive"],  # no drive but them
            0.0,
            0.0,
        )

    watts = {1: 180.0, 2: 120.0, 3: 120.0}
    runs = [simulated(seed, concealed=bearings(size)) for seed, size in watts.items()]
    recorded = replace(campaign(*runs), channels={n: c for n, c in CHANNELS.items() if n != "P_drive"})
    law = Term("bearings", "motor", parse("P_b*(speed/1000)**1.5"))
    terms = tuple(law if t.name == "drive loss" else t for t in model().terms)
    sizes = {n: p for n, p in model().parameters.items() if n != "loss"}
    baseline = replace(model(), terms=terms, parameters={**sizes, "P_b": Parameter(160.0, "W", 0.0)})
    found = document(diagnose(baseline, recorded, ["r1", "r2"], ["r3"]))
    assert found["verdict"] == "missing physics"
    (wear,) = found["physics"]
    assert (wear["effect"], wear["states"], wear["recording"]) == ("wear", ["motor"], "r2")
    assert next(iter(wear["parameters"].values()))["value"] == pytest.approx(-60.0 / 180.0, rel=0.2)


def test_a_law_that_no_entry_has_is_not_given_a_name() -> None:
    """Heat that comes and goes with a clock of its own: place and windows are told, a cause is not."""

    def shift_work(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
        return (0.0, 0.0, 100.0 * np.sin(t / 2500.0) * (np.sin(t / 9000.0) > 0))

    runs = [simulated(seed, concealed=shift_work) for seed in (1, 2)]
    found = document(diagnose(model(), campaign(*runs), ["r1", "r2"]))
    assert found["verdict"] == "unexplained"
    assert found["physics"] == []
    assert found["reasons"]
    assert max(found["location"]["states"], key=found["location"]["states"].__getitem__) == "bed"
    assert found["location"]["windows"]
    assert found["missing_heat"]["over_time"]["r1"]["heat"]
    assert {"speed", "pump", "bed"} <= set(found["missing_heat"]["against"])


def test_heat_of_two_inputs_together_is_no_heat_of_one_of_them() -> None:
    """A brake resistor at the bed heats while two axes work. Heat of one of them explains most of it."""
    work = np.random.default_rng(7).integers(0, 3, (2, 40)) / 2  # of the largest power, for 50 min each

    def axes(t: float | Array) -> Array:
        return np.asarray(np.array([[800.0], [600.0]]) * work[:, np.minimum(t // 3000.0, 39).astype(int)])

    def brake(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
        (x,), (y,) = axes(np.array([t]))
        return (0.0, 0.0, 250.0 * x * y / 480e3)

    runs = [simulated(seed, concealed=brake) for seed in (1, 2)]
    runs = [changed(r, **dict(zip(("P_x", "P_y"), axes(r.time), strict=True))) for r in runs]
    powers = {name: Channel(name, "heat load", "W", None, "held") for name in ("P_x", "P_y")}
    seen = replace(campaign(*runs), channels={**CHANNELS, **powers})
    found = document(diagnose(model(), seen, ["r1", "r2"]))
    assert (found["verdict"], found["physics"]) == ("unexplained", [])
    assert found["reasons"][0] == "heat at bed that follows P_x times P_y explains more than effects do"


def test_a_model_of_the_errors_themselves() -> None:
    """Equation (9) on a machine of three bodies: no crash, and it is said that effects act on rates."""
    runs = [simulated(seed, hours=20.0) for seed in (1, 2)]
    baseline = reduced(["T_env", "P_drive"], ["E_R"], CHANNELS)
    found = document(diagnose(replace(baseline, guessed=True), campaign(*runs), ["r1"], ["r2"]))
    assert found["verdict"] in ("missing physics", "unexplained")
    assert "rates" in found["about"]
    assert set(found["location"]["states"]) == {"E_R"}
    assert found["improvement"]["held_out"]["r2"]["rms_before"] > 2 * NOISE
