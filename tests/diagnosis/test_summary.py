"""The lines for the terminal: sizes with units and intervals, no switches."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from discovery.diagnosis.summary import summary


def number(value: float, low: float | None, high: float | None, unit: str) -> dict[str, Any]:
    return {"value": value, "low": low, "high": high, "unit": unit}


def test_a_size_stands_with_its_unit_and_a_fixed_switch_is_left_out(tmp_path: Path) -> None:
    def named(effect: str, **parameters: dict[str, Any]) -> dict[str, Any]:
        return {"effect": effect, "states": ["T1"], "probability": 0.9, "parameters": parameters}

    physics = [
        named(
            "sensor_lag", on_T1=number(1.0, 1.0, 1.0, "1"), t_lag_T1=number(73701.4, 57024.0, 90383.0, "s")
        ),
        named("cooling_hysteresis", on=number(1.0, 1.0, 1.0, "1")),
        named("thermal_preload", k=number(0.03, 0.02, 0.04, "1/K"), share=number(0.5, 0.4, 0.6, "1")),
        named("friction_speed", P_f={**number(0.686, 0.487, 0.905, "W"), "at": "1000 rpm"}),
        named("radiation", area=number(0.4, None, None, "m2"), power=number(4.0, 4.0, 4.0, "1")),
    ]
    path = named("input_path", k=number(2.0, 1.0, 3.0, "K"))
    physics += [{**path, "channels": [heater]} for heater in ("Q1", "Q2")]
    document: dict[str, Any] = {
        "verdict": "missing physics",
        "model": "m",
        "physics": physics,
        "alternatives": [],
        "reasons": [],
        "description": None,
        "improvement": {"fit": {"rms_before": None}, "held_out": {}, "contradicted_by": []},
        "next_experiment": "none",
    }
    (tmp_path / "diagnosis.json").write_text(json.dumps(document), "utf-8")
    assert summary(tmp_path)[1:-1] == [
        "  sensor_lag at T1, probability 0.90: t_lag_T1 = 73700 s (57020 to 90380)",
        "  cooling_hysteresis at T1, probability 0.90",
        "  thermal_preload at T1, probability 0.90: k = 0.03 1/K (0.02 to 0.04), share = 0.5 (0.4 to 0.6)",
        "  friction_speed at T1, probability 0.90: P_f = 0.686 W at 1000 rpm (0.487 to 0.905)",
        "  radiation at T1, probability 0.90: power = 4",
        "  input_path at T1 from Q1, probability 0.90: k = 2 K (1 to 3)",
        "  input_path at T1 from Q2, probability 0.90: k = 2 K (1 to 3)",
    ]


def test_the_proof_has_a_unit_or_is_in_noises_and_a_jump_that_may_be_none_is_not_told(tmp_path: Path) -> None:
    jumps = {
        "zero_T": {**number(-0.01, -0.03, 0.01, "K"), "output": "T"},
        "zero_dZ": {**number(2.1, 2.0, 2.2, "um"), "output": "dZ"},
        "t_zero": number(60.0, -50.0, 70.0, "s"),
    }
    device = {"effect": "rezero", "states": ["T", "dZ"], "moved": ["dZ"], "recording": "fri"}
    held_out = {"sun": {"rms_before": 0.861, "rms_after": 0.412, "noise_floor": 0.421}}
    document: dict[str, Any] = {
        "verdict": "measurement fault",
        "model": "m",
        "physics": [{**device, "probability": 0.98, "parameters": jumps}],
        "alternatives": [],
        "reasons": [],
        "description": None,
        "next_experiment": "none",
    }
    for unit, said in (("K", " K"), ("1", ""), ("times the reading noise", " times the reading noise")):
        improvement: dict[str, Any] = {
            "unit": unit,
            "fit": {"rms_before": None},
            "held_out": held_out,
            "contradicted_by": [],
        }
        (tmp_path / "diagnosis.json").write_text(
            json.dumps({**document, "improvement": improvement}), "utf-8"
        )
        assert summary(tmp_path)[1:-1] == [
            "  rezero at dZ in fri, probability 0.98: zero_dZ = 2.1 um (2 to 2.2), "
            "t_zero = 60 s (-50 to 70, not determined)",
            f"  held-out recording sun: rms 0.861 -> 0.412{said} "
            f"(reading noise and heat that nobody records explain up to 0.421{said})",
        ]
        improvement["held_out"] = {"sun": {"rms_before": 15.4, "rms_after": 14.1, "noise_floor": 1.94e6}}
        (tmp_path / "diagnosis.json").write_text(
            json.dumps({**document, "improvement": improvement}), "utf-8"
        )
        assert summary(tmp_path)[2] == (
            f"  held-out recording sun: rms 15.4 -> 14.1{said} "
            "(reading noise and heat that nobody records explain all of it)"
        )


def test_where_nothing_is_named_it_says_what_free_runs_leave(tmp_path: Path) -> None:
    """Far from the reading noise, an engineer has to see it, whatever explains it."""
    left = {"rms_before": 4.8, "rms_after": 4.8, "noise_floor": 4.6}
    away = {"rms_before": None, "rms_after": None, "noise_floor": 1.0}
    improvement: dict[str, Any] = {
        "unit": "times the reading noise",
        "fit": left,
        "held_out": {"sun": away},
        "contradicted_by": [],
    }
    document: dict[str, Any] = {
        "verdict": "no mismatch",
        "model": "m",
        "physics": [],
        "alternatives": [],
        "reasons": [],
        "description": None,
        "improvement": improvement,
        "next_experiment": "none",
    }
    (tmp_path / "diagnosis.json").write_text(json.dumps(document), "utf-8")
    (line,) = summary(tmp_path)[1:-1]
    assert line.startswith("  recordings to fit: rms 4.8 times the reading noise (")
    assert line.endswith(
        "reading noise and heat that nobody records explain up to 4.6 times the reading noise)"
    )
    improvement["fit"] = {**left, "expected": 9.87}
    (tmp_path / "diagnosis.json").write_text(json.dumps(document), "utf-8")
    (line,) = summary(tmp_path)[1:-1]
    assert line.endswith("4.6 times the reading noise; parameters that the fit leaves open explain the rest)")
    (tmp_path / "diagnosis.json").write_text(json.dumps(document | {"verdict": "unexplained"}), "utf-8")
    (line,) = summary(tmp_path)[1:-1]
    assert "process noise as large as this model needs explain up to 4.6" in line
    assert "nobody records" not in line
    improvement["fit"] = left
    document["detection"] = {"form_error": 0.08}
    (tmp_path / "diagnosis.json").write_text(json.dumps(document), "utf-8")
    (line,) = summary(tmp_path)[1:-1]
    assert "reading noise, heat that nobody records and flows that are off by 8 % explain up to 4.6" in line


@pytest.mark.parametrize(
    ("starts", "said"),
    [
        (
            [1.11, 0.466],
            "; with start values from all readings, rms 1.11 -> 0.466 K, and this one decides",
        ),
        ([1.11, 1.3], ""),
    ],
)
def test_starts_that_turn_the_proof_around_are_said(tmp_path: Path, starts: list[float], said: str) -> None:
    """A hidden body starts unknown: from first readings alone the right repair may look worse."""
    last = {"rms_before": 2.02, "rms_after": 5.94, "noise_floor": 3.18, "from_known_starts": starts}
    left = {"rms_before": 2.0, "rms_after": 0.4, "noise_floor": 3.0}
    held_out = {"last": last}
    document: dict[str, Any] = {
        "verdict": "missing physics",
        "model": "m",
        "physics": [{"effect": "input_heat", "states": ["core"], "probability": 0.98, "parameters": {}}],
        "alternatives": [],
        "reasons": [],
        "description": None,
        "improvement": {"unit": "K", "fit": left, "held_out": held_out, "contradicted_by": []},
        "next_experiment": "none",
    }
    (tmp_path / "diagnosis.json").write_text(json.dumps(document), "utf-8")
    noise = "reading noise and heat that nobody records explain up to 3.18 K"
    fitted, unseen = summary(tmp_path)[2:4]
    all_of_it = "reading noise and heat that nobody records explain all of it"
    assert fitted == f"  recordings to fit: rms 2 -> 0.4 K ({all_of_it})"
    assert unseen == f"  held-out recording last: rms 2.02 -> 5.94 K ({noise}){said}"


@pytest.mark.parametrize(("before", "known"), [(1.24, 0.24), (1.24, 1.2), (0.25, 0.1)])
def test_a_miss_that_is_how_the_recording_began_is_told_from_one_that_is_not(
    tmp_path: Path, before: float, known: float
) -> None:
    """`no mismatch` beside a large rms would read as a contradiction."""
    fit = {
        "rms_before": before,
        "rms_after": before,
        "noise_floor": 0.23,
        "from_known_starts": [known, known],
    }
    document: dict[str, Any] = {
        "verdict": "no mismatch",
        "model": "m",
        "physics": [],
        "alternatives": [],
        "reasons": [],
        "description": None,
        "improvement": {"unit": "K", "fit": fit, "held_out": {}, "contradicted_by": []},
        "next_experiment": "none",
    }
    (tmp_path / "diagnosis.json").write_text(json.dumps(document), "utf-8")
    (line,) = summary(tmp_path)[1:-1]
    told = line.endswith("; with start values from all readings rms 0.24 K, and this one decides")
    assert told == ((before, known) == (1.24, 0.24))
