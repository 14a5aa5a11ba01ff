"""What happens for a time, or is wrong in one recording: a draught, an input that did not act, a scale."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from discovery.diagnosis import diagnose
from discovery.recordings import Recording
from tests.diagnosis.parts import document
from tests.machine import SIZES, Array, Concealed, Inputs, campaign, changed, claims, model, simulated

ON, OFF = 36000.0, 70000.0  # s


def found(concealed: Concealed | None = None, scale: float = 1.0) -> dict[str, Any]:
    """What a diagnosis finds where something happens in the second of two recordings."""
    other: Recording = simulated(2, concealed=concealed)
    other = changed(other, E_Z=scale * other.values["E_Z"])
    return document(diagnose(model(), campaign(simulated(1), other), ["r1", "r2"]))


def draught(t: float, x: Array, u: Inputs) -> tuple[float, float, float]:
    return 0.0, 6.0 * (u["T_env"] - x[1]) * (ON <= t < OFF), 0.0


def half_a_drive(t: float, _: Array, u: Inputs) -> tuple[float, float, float]:
    return -0.5 * SIZES["loss"] * u["P_drive"] * (ON <= t < OFF), 0.0, 0.0


def cold_workpiece(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
    return 0.0, -400.0 * np.exp(-(t - ON) / 900.0) * (t >= ON), 0.0


def no_fluid(t: float, x: Array, u: Inputs) -> tuple[float, float, float]:
    return 0.0, -SIZES["hF"] * u["pump"] * (u["T_fluid"] - x[1]) * (ON <= t < OFF), 0.0


@pytest.mark.parametrize(
    ("concealed", "effect", "where", "size"),
    [
        (draught, "draught", "table", 6.0),
        (half_a_drive, "input_missed", "P_drive", 0.5),
        (no_fluid, "input_missed", "pump", 1.0),
    ],
)
def test_what_happens_for_a_time_is_named_with_its_hours(
    concealed: Concealed, effect: str, where: str, size: float
) -> None:
    (one,) = found(concealed)["physics"]
    assert (one["effect"], one["states"], one["recording"]) == (effect, [where], "r2")
    amount, on, off = one["parameters"].values()
    assert amount["value"] == pytest.approx(size, rel=0.1)
    assert on["value"] == pytest.approx(ON, abs=3600)
    assert off["value"] == pytest.approx(OFF, abs=3600)


def test_something_cold_that_comes_to_a_body_is_no_jump_of_a_sensor() -> None:
    answer = found(cold_workpiece)
    (one,) = answer["physics"]
    assert (one["effect"], one["states"], one["recording"]) == ("heat_pulse", ["table"], "r2")
    power, instant, constant = (p["value"] for p in one["parameters"].values())
    assert power * constant == pytest.approx(-400.0 * 900.0, rel=0.1)  # J
    assert instant == pytest.approx(ON, abs=900)


def rubs_more(k: int) -> Concealed:
    return lambda _, __, u: (0.15 * k * SIZES["loss"] * u["P_drive"], 0.0, 0.0)


def loosens(k: int) -> Concealed:
    return lambda _, x, __: (0.0, flow := 0.2 * k * SIZES["G_tb"] * (x[1] - x[2]), -flow)


def clogs(k: int) -> Concealed:
    return lambda _, x, u: (-0.25 * k * SIZES["hA_m"] * (u["T_env"] - x[0]), 0.0, 0.0)


@pytest.mark.parametrize(
    ("aged", "effect", "where", "size"),
    [
        (rubs_more, "wear", ["motor"], 0.15),
        (loosens, "joint_loosening", ["table", "bed"], 0.2),
        (clogs, "air_fouling", ["motor"], 0.25),
    ],
)
def test_what_ages_from_recording_to_recording(
    aged: Callable[[int], Concealed], effect: str, where: list[str], size: float
) -> None:
    """As much more in each: no step explains it, and the third recording has twice as much as the second."""
    runs = [simulated(1 + k, hours=20.0, concealed=aged(k)) for k in range(3)]
    (one,) = document(diagnose(model(), campaign(*runs), ["r1", "r2", "r3"]))["physics"]
    assert (one["effect"], one["states"], one["recording"]) == (effect, where, "r2")
    assert one["grows"]
    (each,) = one["parameters"].values()
    assert each["value"] == pytest.approx(size, rel=0.15)


def test_growth_is_no_step_and_two_recordings_show_none() -> None:
    (grows,) = (h for h in claims(model(), "wear", recordings=["r1", "r2", "r3"]) if h.grows)
    assert [grows.share(run) for run in ("r1", "r2", "r3")] == [0.0, 1.0, 2.0]
    assert grows.stated == "wear at motor from r2 on, more in each recording"
    assert not any(h.grows for h in claims(model(), "wear", recordings=["r1", "r2"]))


def test_when_a_part_aged_is_no_other_claim() -> None:
    """A cooler that fouls in each recording was no cooler that fouls, next to a step in the second one."""
    aged = [h for h in claims(model(), "wear", recordings=["r1", "r2", "r3"]) if h.states == ("motor",)]
    assert [(h.recording, h.grows) for h in aged] == [("r2", False), ("r3", False), ("r2", True)]
    assert len({h.key for h in aged}) == 3
    assert {h.claim for h in aged} == {("wear", "motor", None)}
    jumps = claims(model(), "sensor_offset", recordings=["r1", "r2"])
    assert len({h.claim for h in jumps}) == len(jumps)


def test_a_wrong_scale_is_named_in_its_recording() -> None:
    answer = found(scale=1.15)
    (one,) = answer["physics"]
    assert answer["verdict"] == "measurement fault"
    assert (one["effect"], one["states"], one["recording"]) == ("sensor_gain", ["E_Z"], "r2")
    (gain,) = one["parameters"].values()
    assert gain["low"] < 0.15 < gain["high"]
    assert gain["value"] == pytest.approx(0.15, abs=0.02)
