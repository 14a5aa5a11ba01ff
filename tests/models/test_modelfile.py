"""Model files: read, written, read back; mistakes are one sentence with the place."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest

from discovery.dynamics import make_grid, make_system, start_values
from discovery.errors import UserError
from discovery.models import Model, check_model, expanded, read_model, write_model
from discovery.models.thermobalance import thermobalance
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import text

GOOD = """
name = "two bodies"
time_unit = "min"

[parameters]
G    = { start = 24.0, unit = "W/K", min = 0.0 }
loss = { start = 0.3, per = "recording" }
tau  = { start = 900.0, unit = "s", fixed = true }

[states]
a = { capacity = 44.7e3, start = "T_env" }
b = { capacity = 62.4e3, start = 21, start_with = { a = 0.5 } }
y = { unit = "um", start = 0.0, start_sd = 0 }

[[terms]]
name = "link"
into = "a"
from = "b"
expression = "G*(b - a)"

[[terms]]
into = "b"
expression = "loss*lag(P, tau)"

[[terms]]
into = "y"
expression = "a - 22"

[outputs]
E = "1.92*(a - 22) + y"
"""


def written(tmp_path: Path, content: str) -> Path:
    path = tmp_path / "model.toml"
    path.write_text(content)
    return path


def test_a_file_becomes_what_it_says(tmp_path: Path) -> None:
    model = read_model(written(tmp_path, GOOD))
    assert model.inputs == ("P",)
    assert model.free == ("G", "loss")
    assert model.states["a"].scale == 1 / 44.7e3
    assert model.states["y"].scale == 1 / 60
    assert (model.states["a"].start_sd, model.states["y"].start_sd) == (None, 0.0)
    assert model.parameters["loss"].per_recording
    assert [term.name for term in model.terms] == ["link", "term 2", "term 3"]


def test_the_intervals_of_each_recording_stand_in_the_file(tmp_path: Path) -> None:
    model = read_model(written(tmp_path, GOOD))
    own = dataclasses.replace(
        model.parameters["loss"],
        values={"a": 0.2, "b": 0.4},
        intervals={"a": (0.1, 0.3), "b": (0.35, 0.45)},
        spread=0.17,
    )
    fitted = dataclasses.replace(model, parameters={**model.parameters, "loss": own})
    write_model(tmp_path / "again.toml", fitted)
    entry = tomllib.loads((tmp_path / "again.toml").read_text())["parameters"]["loss"]
    assert (entry["low"], entry["high"]) == ({"a": 0.1, "b": 0.35}, {"a": 0.3, "b": 0.45})
    assert read_model(tmp_path / "again.toml").parameters["loss"] == own


def test_a_model_survives_its_file(tmp_path: Path) -> None:
    for model in (read_model(written(tmp_path, GOOD)), thermobalance()):
        fitted = dataclasses.replace(
            model,
            parameters={
                name: dataclasses.replace(p, value=p.value * 1.1, low=0, high=p.value * 2, max=p.value * 9)
                for name, p in model.parameters.items()
            },
        )
        write_model(tmp_path / "again.toml", fitted)
        again = read_model(tmp_path / "again.toml")
        assert again.states == fitted.states
        assert again.outputs == fitted.outputs
        assert [dataclasses.replace(t) for t in again.terms] == list(fitted.terms)
        for name, p in fitted.parameters.items():
            assert again.parameters[name].value == pytest.approx(p.value, rel=1e-9)
            assert again.parameters[name].low == 0.0
            assert again.parameters[name].unit == p.unit


def test_hidden_states_that_count_in_seconds_survive_a_file_in_hours(tmp_path: Path) -> None:
    """A lag becomes a state in seconds; its file counts in minutes, and the trajectory stays the same."""
    import numpy as np

    from discovery.dynamics import make_grid, make_system, simulate
    from discovery.recordings import Campaign, Channel, Recording

    time = np.arange(0.0, 7201.0, 60.0)
    names = ("P", "T_env", "E")
    channels = {name: Channel(name, "other input", "1", None, "held") for name in names}
    values = {"P": 100.0 * (time > 1000), "T_env": np.full(len(time), 22.0), "E": np.zeros(len(time))}
    campaign = Campaign("c", channels, {"r": Recording("r", time, values)})
    model = expanded(read_model(written(tmp_path, GOOD)))
    moved = dataclasses.replace(
        model.terms[0], into="lag_1", source="y"
    )  # between states of different clocks
    for one in (model, dataclasses.replace(model, terms=(*model.terms, moved))):
        write_model(tmp_path / "again.toml", one)
        again = read_model(tmp_path / "again.toml")
        paths = []
        for m in (one, again):
            grid = make_grid(campaign, "r", names[:2], ["E"])
            paths.append(simulate(make_system(m, grid), m.values()).x)
        assert np.allclose(paths[0], paths[1], rtol=1e-9)
        assert np.ptp(paths[0][:, 3]) > 50


def test_a_value_on_its_bound_is_read_back(tmp_path: Path) -> None:
    model = thermobalance()
    third = dataclasses.replace(model.parameters["G_b1_b2"], value=1 / 48, min=1 / 48, max=1 / 3)
    write_model(
        tmp_path / "m.toml", dataclasses.replace(model, parameters={**model.parameters, "G_b1_b2": third})
    )
    assert read_model(tmp_path / "m.toml").parameters["G_b1_b2"].value == pytest.approx(1 / 48)


def test_terms_of_one_name_are_told_apart_in_a_file(tmp_path: Path) -> None:
    model = thermobalance()
    write_model(tmp_path / "m.toml", model.with_terms(model.terms[0], model.terms[0]))
    again = [term.name for term in read_model(tmp_path / "m.toml").terms]
    first = model.terms[0].name
    assert again == [*(term.name for term in model.terms), f"{first} (2)", f"{first} (3)"]


def test_a_lag_becomes_a_hidden_state(tmp_path: Path) -> None:
    model = expanded(read_model(written(tmp_path, GOOD)))
    assert text(model.terms[-1].expression) == "(P - lag_1)/tau"
    assert list(model.states) == ["a", "b", "y", "lag_1"]


def test_a_memory_keeps_to_itself(tmp_path: Path) -> None:
    """Every lag_N that anything else is called by stays what it was, and a file says what is a memory."""
    mine = GOOD.replace("b =", "lag_1 =").replace('"b"', '"lag_1"').replace("b - a", "lag_1 - a")
    mine = mine.replace("tau ", "lag_2 ").replace("lag(P, tau)", "lag(P, lag_2)*lag(lag_3, 60)")
    before = read_model(written(tmp_path, mine))
    model = expanded(before, {"P", "T_env", "lag_3", "lag_4"})
    assert list(model.states) == ["a", "lag_1", "y", "lag_5", "lag_6"]
    assert {name: model.states[name] for name in before.states} == before.states
    assert [text(t.expression) for t in model.terms[1:]] == [
        "loss*lag_5*lag_6",
        "a - 22",
        "(P - lag_5)/lag_2",
        "(lag_3 - lag_6)/60",
    ]
    assert [s.name for s in model.states.values() if s.memory] == ["lag_5", "lag_6"]
    write_model(tmp_path / "again.toml", model)
    assert [s.name for s in read_model(tmp_path / "again.toml").states.values() if s.memory] == [
        "lag_5",
        "lag_6",
    ]
    assert read_model(written(tmp_path, mine)).states["lag_1"].memory is False


def test_a_memory_of_memories_starts_settled(tmp_path: Path) -> None:
    nested = GOOD.replace("lag(P, tau)", "lag(delay(P, 60) + play(lag(T_env, 9), 1), tau)")
    model = expanded(read_model(written(tmp_path, nested)))
    assert model.states["lag_2"].memory
    time = np.arange(0.0, 601.0, 60.0)
    channels = {
        name: Channel(name, role, unit, None, "held")
        for name, role, unit in (("P", "heat load", "W"), ("T_env", "ambient temperature", "degC"))
    }
    values = {"P": np.full(len(time), 7.0), "T_env": np.full(len(time), 21.0)}
    seen = Campaign("c", channels, {"r": Recording("r", time, values)})
    system = make_system(model, make_grid(seen, "r", list(channels), []))
    start = dict(zip(system.states, start_values(system, model.values()), strict=True))
    assert start["lag_2"] == pytest.approx(28.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('into = "y"', 'into = "z"', ["line 26", "'z' is not a state", "a, b, y"]),
        ("G*(b - a)", "G*(b - a", ["line 19", "not a formula"]),
        ("G*(b - a)", "__import__('os')", ["line 19", "unknown function"]),
        ("capacity = 44.7e3", "capacity = -1", ["line 11", "greater than 0"]),
        ("capacity = 44.7e3", 'capacity = "C"', ["line 11", "not 'C'", "write each term as a rate, as P/C"]),
        ("min = 0.0", "min = 30.0", ["line 6", "start 24"]),
        ("[states]", "[state]", ["unknown key", "did you mean 'states'"]),
        ("fixed = true", "fixd = true", ["line 8", "did you mean 'fixed'"]),
        ('time_unit = "min"', 'time_unit = "minutes"', ["line 3", "min"]),
        ("{ a = 0.5 }", "{ y = 0.5 }", ["line 12", "'y' is not a state above 'b'"]),
        ("G    =", "exp =", ["line 6", "cannot name"]),
        ("G    =", '"µ" =', ["line 6", "'µ' cannot name a parameter"]),
        ("G    =", '"ﬁx" =', ["line 6", "cannot name a parameter"]),
        ("y = {", '"ÿ" = {', ["line 13", "cannot name a state"]),
        ("G    =", "a =", ["line 6", "also a state"]),
        ('per = "recording"', 'per = "day"', ["line 7", "recording"]),
        ("start = 24.0", 'start = "24"', ["line 6", "should be a valid number"]),
        ("start = 24.0", "start = nan", ["line 6", "should be a finite number"]),
        ('from = "b"', 'from = "a"', ["line 18", "'a' is also into"]),
        ("[outputs]", '[[terms]]\nname = "link"\ninto = "a"\nexpression = "G"\n[outputs]', ["named 'link'"]),
        ('start = "T_env"', 'start = "lag(T_env, 600)"', ["line 11", "before the recording"]),
        ('start = "T_env"', 'start = "22 + delay(T_env, 600)"', ["line 11", "before the recording"]),
        ("lag(P, tau)", "delay(b, 600)", ["line 23", "'delay(b, 600)'", "only a channel can be delayed"]),
        ("lag(P, tau)", "delay(tau, 600)", ["line 23", "only a channel can be delayed"]),
        ("lag(P, tau)", "delay(time, 600)", ["line 23", "only a channel can be delayed"]),
        ("lag(P, tau)", "exp(delay(P, 10*P))", ["line 23", "the delay in", "no states and no channels"]),
        ("lag(P, tau)", "delay(P, -tau)", ["line 23", "a number of seconds from 0 up"]),
        ("lag(P, tau)", "delay(P, 1/0)", ["line 23", "a number of seconds from 0 up"]),
        ("lag(P, tau)", "delay(P, 60*G - 60*tau)", ["line 23", "a number of seconds from 0 up"]),
        ("lag(P, tau)", "delay(P, lag(3, tau))", ["line 23", "the delay in"]),
        ("lag(P, tau)", "lag(P, a)", ["line 23", "time constant", "no states and no channels"]),
        ("lag(P, tau)", "lag(P, 0*tau)", ["line 23", "a number of seconds above 0"]),
        ("lag(P, tau)", "play(P, P)", ["line 23", "the width in 'play(P, P)' must be a number"]),
        ("1.92*(a - 22) + y", "delay(P, -60)", ["line 30", "a number of seconds from 0 up"]),
    ],
)
def test_mistakes(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in GOOD
    with pytest.raises(UserError) as caught:
        read_model(written(tmp_path, GOOD.replace(old, new)))
    sentence = str(caught.value)
    assert "\n" not in sentence
    for word in ("model.toml", *words):
        assert word in sentence


def test_no_fit_looks_into_the_future(tmp_path: Path) -> None:
    late = GOOD.replace("lag(P, tau)", "delay(P, 60*wait)")
    for bounds, good in (("", False), (", min = 0.0", True), (", fixed = true", True)):
        wait = f"[parameters]\nwait = {{ start = 3.0{bounds} }}"
        content = late.replace("[parameters]", wait)
        model = read_model(written(tmp_path, content))  # as it is, it may be exported
        if good:
            check_model(model, {"P": "W", "T_env": "degC"}, "m.toml")
        else:
            with pytest.raises(UserError, match=r"term 2'.*'wait' a value below 0.*give the parameter min"):
                check_model(model, {"P": "W", "T_env": "degC"}, "m.toml")


def test_the_clock_of_one_recording_may_be_early(tmp_path: Path) -> None:
    late = GOOD.replace("lag(P, tau)", "delay(P, shift)")
    shift = '[parameters]\nshift = { start = 0.0, per = "recording", values = { r = -900.0 } }'
    model = read_model(written(tmp_path, late.replace("[parameters]", shift)))
    check_model(model, {"P": "W", "T_env": "degC"}, "m.toml")
    assert model.parameters["shift"].values == {"r": -900.0}


def test_a_parameter_hides_no_channel(tmp_path: Path) -> None:
    model = read_model(written(tmp_path, GOOD))
    with pytest.raises(UserError, match=r"m.toml, key parameters.loss: 'loss' is also a channel.*rename"):
        check_model(model, {"P": "W", "T_env": "degC", "loss": "W"}, "m.toml")


def test_a_name_that_nobody_knows(tmp_path: Path) -> None:
    model: Model = read_model(written(tmp_path, GOOD))
    check_model(model, {"P": "W", "T_env": "degC"}, "model.toml")
    with pytest.raises(UserError, match=r"start of 'a': 'T_env' is neither"):
        check_model(model, {"P": "W"}, "model.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"W/K"', '"kW/K"', r"parameters.G.unit: 'kW/K' counts in kW, .*write unit, value and bounds in W$"),
        ('"W/K"', '"W/degF"', r"'W/degF' counts in (delta_)?degF, .* in degC, in differences K$"),
        ('"W/K"', '"J/ms/K"', r"'J/ms/K' counts in ms, .* in s or min or h or d$"),
        ('"W/K"', '"W/mK"', r"'W/mK' counts in mK"),
        ("a = {", 'a = { unit = "degF",', r"states.a.unit: 'degF' counts in degF"),
        ('unit = "um"', 'unit = "inch"', r"states.y.unit: 'inch' counts in in, .* in um or mm or m$"),
    ],
)
def test_nothing_is_converted_inside(tmp_path: Path, old: str, new: str, said: str) -> None:
    model = read_model(written(tmp_path, GOOD.replace(old, new, 1)))
    with pytest.raises(UserError, match=rf"m.toml, key .*{said}"):
        check_model(model, {"P": "W", "T_env": "degC"}, "m.toml")


@pytest.mark.parametrize(
    "unit", ["um/m/(W*rpm**2)/h", "l/min", "W/percent", "J/kg/K", "bar", "K**1.25", "kg/m**3", "N", "", "1/d"]
)
def test_what_models_count_in(tmp_path: Path, unit: str) -> None:
    model = read_model(written(tmp_path, GOOD.replace('"W/K"', f'"{unit}"')))
    check_model(model, {"P": "W", "T_env": "degC"}, "m.toml")
    assert unit in {parameter.unit for parameter in model.parameters.values()}


def test_a_unit_that_a_channel_has_is_counted_in(tmp_path: Path) -> None:
    """An input of any kind keeps its unit; so do the coefficients that go with it."""
    model = read_model(written(tmp_path, GOOD.replace('"W/K"', '"K/kW/delta_degF"')))
    with pytest.raises(UserError, match="'K/kW/delta_degF' counts in"):
        check_model(model, {"P": "kW", "T_env": "degC"}, "m.toml")
    check_model(model, {"P": "kW", "T_env": "degF"}, "m.toml")
