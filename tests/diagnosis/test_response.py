"""How an output follows inputs, where the model misses it: against scipy, with known gains and times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from discovery.diagnosis import diagnose
from discovery.diagnosis.response import Part, Response, responses
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.diagnosis.parts import context_of

EVERY = 20.0  # s
EARLY, LATE = (3.0, 60.0), (-5.0, 1400.0)  # um/K and s: a frame that a hot bed first lifts, then lowers
CHANNELS = {
    "bed": Channel("bed", "other input", "degC", None, "linear"),
    "Z": Channel("Z", "error", "um", None, "linear"),
}


def recording(seed: int, *answers: tuple[float, float]) -> Recording:
    """A bed that is heated to random temperatures, and an error that follows it; noise of 1 um."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 4 * 3600.0, EVERY)
    wanted = np.repeat(rng.uniform(25.0, 110.0, len(time) // 120 + 1), 120)[: len(time)] - 25.0
    bed = 25.0 + lsim(([1.0], [150.0, 1.0]), wanted, time)[1]
    error = sum(gain * lsim(([1.0], [tau, 1.0]), bed - bed[0], time)[1] for gain, tau in answers)
    return Recording(
        f"r{seed}", time, {"bed": bed, "Z": 40.0 * seed + error + rng.standard_normal(len(time))}
    )


def campaign(*answers: tuple[float, float], seeds: tuple[int, ...] = (1, 2)) -> Campaign:
    runs = [recording(seed, *answers) for seed in seeds]
    return Campaign("frame", CHANNELS, {run.name: run for run in runs})


def cut(run: Recording, begin: float) -> Recording:
    """A recording from an instant on, on its own clock."""
    rows = run.time >= begin
    return Recording(run.name, run.time[rows] - begin, {name: v[rows] for name, v in run.values.items()})


def one_mass() -> Model:
    """A mass that follows the bed."""
    return Model(
        "one mass",
        {
            "tau": Parameter(2000.0, "s", min=10.0),
            "k": Parameter(-3.0, "um/K"),
            "z": Parameter(0.0, "um", per_recording=True),
        },
        {"frame": State("frame", "degC", None, parse("bed"))},
        (Term("bed", "frame", parse("(bed - frame)/tau")),),
        {"Z": parse("k*(frame - 25) + z")},
    )


def test_two_times_of_opposite_sign_are_found_with_their_gains() -> None:
    (found,) = responses(context_of(campaign(EARLY, LATE), one_mass(), outputs=("Z",)))
    early, late = sorted(found.parts, key=lambda p: p.seconds)
    for part, (gain, tau) in ((early, EARLY), (late, LATE)):
        assert part.gain == pytest.approx(gain, rel=0.05)
        assert part.seconds == pytest.approx(tau, rel=0.1)
        assert part.low <= part.seconds <= part.high
        assert (part.input, part.unit) == ("bed", "um/K")
    assert found.left == pytest.approx(1.0, abs=0.1)  # the noise of the readings
    assert found.left_by_model > 5
    assert "Z follows bed with two time constants of opposite sign: +" in found.sentence()


def test_a_recording_may_begin_with_the_heater_on_and_the_machine_unsettled() -> None:
    """The lags of the first hours before each recording: what it began with is not known."""
    gains = (EARLY, LATE)
    runs = [cut(recording(seed, *gains), 3000.0 + 500 * seed) for seed in (1, 2)]
    seen = Campaign("frame", CHANNELS, {run.name: run for run in runs})
    (found,) = responses(context_of(seen, one_mass(), outputs=("Z",)))
    early, late = sorted(found.parts, key=lambda p: p.seconds)
    for part, (gain, tau) in ((early, EARLY), (late, LATE)):
        assert part.gain == pytest.approx(gain, rel=0.05)
        assert part.seconds == pytest.approx(tau, rel=0.1)
    assert found.left == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("role", ["error", "temperature"])
def test_a_thermometer_does_not_follow_another_one(role: str) -> None:
    """Both answer to the same heat; an error does follow what thermometers show."""
    channels = CHANNELS | {"bed": replace(CHANNELS["bed"], role="temperature")}
    channels["Z"] = replace(CHANNELS["Z"], role=role, unit="um" if role == "error" else "degC")
    seen = replace(campaign(EARLY, LATE), channels=channels)
    assert bool(responses(context_of(seen, one_mass(), outputs=("Z",)))) is (role == "error")


def test_nothing_is_said_where_starts_alone_explain_the_readings() -> None:
    """A machine that only cools, and an input that moves without any effect."""
    runs = []
    for seed in (1, 2):
        run = recording(seed)
        warm = 60.0 * np.exp(-run.time / 1400.0)
        runs.append(replace(run, values={**run.values, "Z": run.values["Z"] + warm}))
    seen = Campaign("frame", CHANNELS, {run.name: run for run in runs})
    assert responses(context_of(seen, one_mass(), outputs=("Z",))) == []


def test_nothing_is_said_where_the_model_predicts_as_well() -> None:
    assert responses(context_of(campaign(LATE), one_mass(), outputs=("Z",))) == []


def test_nothing_is_said_of_a_single_recording() -> None:
    """No recording can be left out."""
    assert responses(context_of(campaign(EARLY, LATE, seeds=(1,)), one_mass(), outputs=("Z",))) == []


def test_file_and_summary_of_a_diagnosis_say_it() -> None:
    seen = campaign(EARLY, LATE)
    answer = diagnose(one_mass(), seen, ("r1", "r2"))
    # a path with a lag and a mass behind the frame are the same sum of two answers
    (named,) = (p.effect for p in answer.document().physics)
    assert named in ("input_path", "second_thermal_mass")
    assert answer.responses == ()  # what has a name is not described
    said = tuple(responses(context_of(seen, one_mass(), outputs=("Z",))))
    without = replace(answer, responses=said)
    (row,) = without.document().responses
    assert [p.time_constant_s for p in row.parts] == [float(f"{p.seconds:.4g}") for p in said[0].parts]
    assert row.sentence in without.summary()


def test_what_cannot_be_told_from_an_answer_at_once_is_called_so() -> None:
    parts = (Part("P", -0.8, "um/W", 300.0, 300.0, 310.0), Part("F", 0.1, "um/W", 7200.0, 5400.0, 9000.0))
    said = Response("E", "um", parts, 0.9, 1.7, 303.0, 9000.0).sentence()
    assert said.startswith("E follows P: -0.8 um/W at once; F: +0.1 um/W after 2 h (1.5 h to 2.5 h) (rms ")
    assert "(rms 0.9 um on recordings left out of the fit, 1.7 with the model; " in said


def test_a_time_constant_as_long_as_the_recordings_is_a_ramp() -> None:
    """A roast of 10 min: `+1 K/percent after 10 min` would say a gain that nothing shows."""
    said = Response("BT", "K", (Part("air", 1.2, "K/percent", 600.0, 600.0, 600.0),), 0.9, 1.7, 5.0, 594.0)
    assert said.sentence().startswith(
        "BT follows air: +0.12 K/percent each minute, for longer than a recording (10 min) (rms 0.9 K"
    )
