"""Update: where the machine began in new recordings says nothing of its sensors, and texts fit its inputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discovery.export.document import Exported, from_document, render
from discovery.export.guessed import START_SD, at_readings
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.runtime.advice import to_distinguish
from discovery.runtime.hypotheses import Comparison, begun, compare
from discovery.runtime.update import Update
from discovery.terms import Name, Term, parse

ROOM = 26.0  # degC, in all readings
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}


def machine() -> Model:
    """A chip on a board with heat that is always there, in a case: all begin 10 to 14 K above the room."""
    states = {
        "T": State("T", "degC", 3.0, None, None, 1 / 3.0),
        "board": State("board", "degC", 40.0, None, 2.67, 1 / 40.0),
        "case": State("case", "degC", 200.0, None, 3.06, 1 / 200.0),
    }
    parameters = {"G1": (3.3, "W/K"), "G2": (1.0, "W/K"), "k": (0.45, "W/K"), "q": (4.5, "W")}
    return Model(
        "chip",
        {name: Parameter(value, unit, min=0.0) for name, (value, unit) in parameters.items()},
        states,
        (
            Term("load", "T", parse("P")),
            Term("joint", "board", parse("G1*(T - board)"), "T"),
            Term("idle", "board", parse("q")),
            Term("screws", "case", parse("G2*(board - case)"), "board"),
            Term("air", "case", parse("k*(room - case)")),
        ),
        {"T": Name("T")},
    )


def read(seed: int = 1) -> Campaign:
    """Recordings of 25 and of 10 min, a reading every 5 s with a noise of 0.45 K, exact but for it."""
    found = {}
    for n, (power, seconds) in {"busy": (6.0, 1500.0), "idle": (0.0, 600.0)}.items():
        time = np.arange(0.0, seconds, 5.0)
        load = np.where((time > 0.0) & (time < 900.0), power, 0.0)
        x, series = np.array([ROOM + 14.5, ROOM + 14.5, ROOM + 10.0]), []
        for p in load:
            series.append(x[0])
            for _ in range(50):
                a, b = 3.3 * (x[0] - x[1]), x[1] - x[2]
                x = x + 0.1 * np.array([p - a, 4.5 + a - b, b - 0.45 * (x[2] - ROOM)]) / [3.0, 40.0, 200.0]
        noise = np.random.default_rng([seed, len(n)]).normal(0.0, 0.45, len(time))
        found[n] = Recording(n, time, {"P": load, "room": np.full(len(time), ROOM), "T": series + noise})
    return Campaign("c", CHANNELS, found)


def exported() -> Exported:
    """The machine at work, whose parameters its fit left unsure: a hundredth of each reading is known."""
    document = make_document(machine(), read(), ["busy", "idle"])
    known = document["knowledge"]
    known["rows"] = [[0.1 * v for v in row] for row in known["rows"]]
    return from_document(*open_seal(render(document), "chip"), "chip")


def test_a_machine_that_never_begins_at_its_room_has_no_faulty_sensor() -> None:
    """An export guesses a start at the room. On the recordings of the fit itself nothing has changed."""
    at_work = exported()
    assert at_work.model.states["T"].start == Name("room")
    for campaign in (read(), read(seed=2)):
        found = compare(at_work, campaign, ["busy", "idle"])
        assert found.verdict == "nothing", found
        assert found.odds["sensor of room"] < 0.0


def test_a_start_is_read_where_it_was_guessed_and_read() -> None:
    at_work, campaign = exported(), read()
    states = at_work.model.states
    assert at_readings(at_work.model, campaign, ["busy", "idle"]).states["T"].start is None
    given = replace(at_work.model, states={"T": replace(states["T"], start_sd=0.25 * START_SD)})
    assert at_readings(given, campaign, ["busy", "idle"]).states["T"] == given.states["T"]
    wider = replace(at_work.model, states={"T": replace(states["T"], start_sd=2.5 * START_SD)})
    assert at_readings(wider, campaign, ["busy", "idle"]).states["T"].start is None
    silent = replace(campaign.recordings["idle"], values={"P": np.zeros(120), "T": np.full(120, np.nan)})
    partly = replace(campaign, recordings={**campaign.recordings, "idle": silent})
    assert at_readings(at_work.model, partly, ["busy", "idle"]).states["T"] == states["T"]
    known = begun(at_work, campaign, ["busy"], {"T": 40.0}).model.states["T"]
    assert known.start == parse("40.0")


def test_texts_fit_the_inputs_of_the_machine() -> None:
    said = to_distinguish(exported(), read(), ["busy", "idle"])
    assert said == "measure more often, with P as different as can be, and where room is not 26"
    odds = {"nothing": 0.0, "exchange with room": -0.04, "drift at T": 4.7}
    found = Comparison(("a",), 9, "nothing", "", odds, 4.0, 4.0, {}, np.zeros((0, 1)))
    assert "exchange with room +0.0" in str(found)
    assert "no change of the machine that is sure; drift at T may have begun" in Update(found).lines()[-1]
    quiet = replace(found, odds={**odds, "drift at T": -1.0})
    assert Update(quiet).lines()[-1].endswith("no change of the machine")
