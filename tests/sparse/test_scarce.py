"""Little is recorded, or slowly: minutes of a heater board, days of a heated room."""

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import predict
from discovery.fitting import fit_model, predict_recording
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.byrates import plainer
from discovery.sparse.discover import discover
from discovery.sparse.discovery import Discovery
from discovery.sparse.gram import gram
from discovery.sparse.options import SparseOptions
from discovery.sparse.rates import without_idle
from discovery.sparse.search import Search, plain
from discovery.sparse.temperatures import second_masses
from discovery.terms import Term, parse

Array = NDArray[np.float64]


def campaign(time: Array, room: Array, heat: dict[str, Array], measured: dict[str, Array]) -> Campaign:
    channels = {name: Channel(name, "heat load", "W", None, "held") for name in heat}
    channels |= {name: Channel(name, "temperature", "degC", None, "linear") for name in measured}
    channels["T_room"] = Channel("T_room", "ambient temperature", "degC", None, "linear")
    values = {**heat, **measured, "T_room": room}
    cut = round(0.67 * len(time))
    made = {
        "first": Recording("first", time[:cut], {n: v[:cut] for n, v in values.items()}),
        "last": Recording("last", time[cut:] - time[cut], {n: v[cut:] for n, v in values.items()}),
    }
    return Campaign("scarce", channels, made, Path("scarce"))


def missed(model: Model, where: Campaign, recording: str, outputs: list[str]) -> Array:
    run = predict_recording(model, where, recording, outputs)
    return np.asarray(np.sqrt(np.nanmean((run.system.grid.readings - predict(run)) ** 2, axis=0)))


def board() -> Campaign:
    """Five minutes, three pulses of the first of two heaters; sensors of 0.3 K steps that lag by 20 s."""
    time = np.arange(0.0, 333.0, 3.0)
    q = 43.0 * ((time >= 23) & (time < 46)) + 56.0 * ((time >= 113) & (time < 132))
    q += 32.0 * ((time >= 211) & (time < 259))
    body, sensor = np.array([24.2, 23.8]), np.array([24.2, 23.8])
    seen = []
    for k in range(len(time)):
        seen.append(np.round(sensor / 0.32) * 0.32)
        for _ in range(30):
            flow = 0.0025 * (body[::-1] - body) + 0.006 * (23.8 - body) + np.array([0.0055, 0.0]) * q[k]
            body, sensor = body + 0.1 * flow, sensor + 0.1 * (body - sensor) / 20
    measured = dict(zip(("T1", "T2"), np.array(seen).T, strict=True))
    return campaign(time, 0 * time + 23.8, {"Q1": q, "Q2": 0 * q}, measured)


def discovered(where: Campaign, outputs: list[str]) -> Discovery:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return discover(where, ["first"], outputs, SparseOptions(bootstraps=0))


def test_three_minutes_of_a_heater_are_explained_by_the_heater() -> None:
    """The weak form starts from terms that run away here; the search ended with nothing but the room."""
    where = board()
    found = discovered(where, ["T1", "T2"])
    assert "T1_body: Q1" in found.report["groups"][0]["kept"]
    assert not any("mass" in name for name in found.model.states)  # nothing asks for them
    assert max(missed(found.model, where, "first", ["T1", "T2"])) < 0.35


def motor() -> Campaign:
    """Nine minutes on and off, with electronics that stay on."""
    time = np.arange(0.0, 540.0, 3.0)
    on = np.where((time - 4) % 180 < 90, 1.0, 0.0)
    body, seen = 21.3, list[float]()
    rng = np.random.default_rng(8)
    for k in range(len(time)):
        seen.append(round(body + 0.05 * rng.standard_normal(), 1))
        for _ in range(30):
            body += 0.1 * (0.03 * (21.3 - body) + 0.13 * on[k] + 0.12 * (time[k] > 3))
    return campaign(time, 0 * time + 21.3, {"P": on}, {"T": np.array(seen)})


def test_the_room_of_a_single_recording_is_no_place_for_steady_heat() -> None:
    """Free runs began 2 K below what the fit had made of the room."""
    where = motor()
    found = discovered(where, ["T"])
    assert missed(found.model, where, "first", ["T"])[0] < 1.5  # 3.7 with a room that may move


def test_without_a_heat_load_the_plain_rival_has_the_other_inputs() -> None:
    """The sizes that the search keeps hold no more than the room here; the rival is weighed all the same."""
    time = np.arange(0.0, 540.0, 3.0)
    seen = 21.3 + 9 * np.exp(-time / 60) + 0.05 * np.random.default_rng(3).standard_normal(len(time))
    where = campaign(time, 0 * time + 21.3, {"P": np.where(time % 90 < 40, 1.0, 0.0)}, {"T": seen})
    channels = {**where.channels, "P": Channel("P", "other input", "A", None, "held")}
    found = discovered(Campaign("idle", channels, where.recordings, Path("idle")), ["T"])
    plain = {"T_lag", "T_body: room - T_body", "T_body: P"}
    assert plain in [set(point.names) for point in found.path]


def test_a_room_of_air_and_walls_gets_its_walls() -> None:
    """Readings every half hour: masses of minutes behind a body, right for a board, are of no use there."""
    time = np.arange(0.0, 5 * 86400.0, 1800.0)
    out = np.asarray(15 + 6 * np.sin(2 * np.pi * time / 86400), dtype=np.float64)
    heat = np.where(time % 172800 > 86400, 2000.0, 0.0)
    air, wall, seen = 20.0, 20.0, list[float]()
    rng = np.random.default_rng(2)
    for k in range(len(time)):
        seen.append(air + 0.05 * rng.standard_normal())
        for _ in range(30):
            flow = 150 * (wall - air)
            air += 60 * (heat[k] + flow + 30 * (out[k] - air)) / 2e6
            wall += 60 * (-flow + 20 * (out[k] - wall)) / 1.2e7
    where = campaign(time, out, {"P": heat}, {"T_in": np.array(seen)})
    found = discovered(where, ["T_in"])
    assert any("mass" in label for label in found.report["groups"][0]["kept"])
    assert missed(found.model, where, "first", ["T_in"])[0] < 0.5


def test_masses_go_with_the_length_of_the_recordings() -> None:
    assert second_masses(2.1 * 3600) == (300.0, 1200.0)
    assert second_masses(420.0)[1] < 420.0 / 3
    assert second_masses(5 * 86400.0)[1] > 6 * 3600


def test_a_block_without_readings_is_no_warning() -> None:
    where = board()
    first = where.recordings["first"]
    holes = {n: np.where((first.time > 90) & (first.time < 110), np.nan, v) for n, v in first.values.items()}
    holes |= {n: v for n, v in first.values.items() if n not in ("T1", "T2")}
    gone = Recording("first", first.time, holes)
    found = discovered(
        Campaign("holes", where.channels, {"first": gone, "last": where.recordings["last"]}, Path("holes")),
        ["T1", "T2"],
    )
    assert found.path


def test_cells_of_one_sensor_may_be_empty_where_another_was_read() -> None:
    where = board()
    first = where.recordings["first"]
    read = np.where(np.arange(len(first.time)) % 9 == 0, np.nan, first.values["T1"])
    gaps = {**where.recordings, "first": Recording("first", first.time, {**first.values, "T1": read})}
    found = discovered(Campaign("gaps", where.channels, gaps, Path("gaps")), ["T1", "T2"])
    assert missed(found.model, where, "last", ["T1", "T2"]).max() < 0.6  # two steps of the sensor


def test_the_plainer_of_two_twins_is_named_and_no_other() -> None:
    rng = np.random.default_rng(4)
    twin = rng.uniform(0, 10, 300)
    x = np.column_stack([twin, twin + 1e-3 * twin**2, rng.standard_normal(300)])
    search = Search(
        gram(x, 2 * x[:, 1] + x[:, 2] + 0.1 * rng.standard_normal(300)), plain(3), np.array([], int)
    )
    odd, names = search.of(np.array([1, 2])), ("a", "b", "c")
    assert plainer(search, odd, names, ["a"], worth=20.0).members == (0, 2)
    assert plainer(search, odd, names, ["a"], worth=1e-9).members == (1, 2)
    kept = Search(search.g, plain(3), np.array([1]))
    assert plainer(kept, kept.of(np.array([1, 2])), names, ["a"], worth=20.0).members == (1, 2)


def test_what_moves_no_output_leaves_with_its_numbers() -> None:
    p = {name: Parameter(1.0) for name in ("a", "b", "shared")}
    states = {name: State(name) for name in ("T", "room", "ghost", "echo")}
    terms = (
        Term("loss", "T", parse("a*(room - T)*shared")),
        Term("ghost follows", "ghost", parse("b*shared*(T - ghost)")),
        Term("echo follows", "echo", parse("ghost - echo")),
    )
    small = without_idle(Model("m", p, states, terms, {}), ["T"])
    assert set(small.states) == {"T", "room"}
    assert [t.name for t in small.terms] == ["loss"]
    assert set(small.parameters) == {"a", "shared"}
    shown = without_idle(Model("m", p, states, terms, {"T": parse("T + echo")}), ["T"])
    assert len(shown.terms) == 3


def spindle() -> dict[str, Array]:
    """Eight hours of a spindle test: minutes, room, speed, two body temperatures, displacement."""
    time = np.arange(0.0, 480 * 60.0, 60.0)
    speed = np.where(time < 600, 0.0, np.where(time < 12000, 6000.0, np.where(time < 18000, 0.0, 3000.0)))
    room = np.asarray(20 + 0.8 * np.sin(time / 9000), dtype=np.float64)
    rng = np.random.default_rng(1)
    bearing, column, bodies, seen = 20.0, 20.0, list[tuple[float, float]](), list[float]()
    for k in range(len(time)):
        bearing += 9e-5 * speed[k] - 0.02 * (bearing - room[k])
        column += 0.01 * (bearing - column) - 0.004 * (column - room[k])
        bodies.append((bearing + 0.05 * rng.standard_normal(), column + 0.05 * rng.standard_normal()))
        seen.append(1.3 * (bearing - 20) + 2.2 * (column - 20) + 0.3 * rng.standard_normal())
    one, two = np.array(bodies).T
    return {"time": time, "T_room": room, "speed": speed, "T1": one, "T2": two, "Z": np.array(seen)}


def spindle_campaign(names: tuple[str, ...]) -> Campaign:
    channels = {
        "T_room": Channel("T_room", "ambient temperature", "degC", None, "linear"),
        "speed": Channel("speed", "rotation speed", "rpm", None, "held"),
        "T1": Channel("T1", "other input", "degC", None, "linear"),
        "T2": Channel("T2", "other input", "degC", None, "linear"),
        "Z": Channel("Z", "error", "um", None, "linear"),
    }
    table = spindle()
    time = table.pop("time")
    made = {
        "first": Recording("first", time[:320], {n: table[n][:320] for n in names}),
        "last": Recording("last", time[320:] - time[320], {n: table[n][320:] for n in names}),
    }
    return Campaign("spindle", {n: channels[n] for n in names}, made, Path("spindle"))


def test_fit_and_free_run_of_hidden_masses_begin_at_one_place() -> None:
    """A refit moved the start values with the parameters; free runs were off by 30 um."""
    where = spindle_campaign(("T_room", "speed", "Z"))
    found = discovered(where, ["Z"])
    again = fit_model(found.model, where, ["first"], ["Z"])
    assert missed(found.model, where, "first", ["Z"])[0] < 1.0
    assert missed(again.model, where, "first", ["Z"])[0] < 1.0


def test_an_error_follows_the_temperatures_of_its_bodies() -> None:
    """The unseen part begins on a warm machine: measured bodies say how warm; the error was off by 45 um."""
    where = spindle_campaign(("T_room", "T1", "T2", "Z"))
    found = discovered(where, ["Z"])
    assert missed(found.model, where, "first", ["Z"])[0] < 0.5
    assert missed(found.model, where, "last", ["Z"])[0] < 3.0
