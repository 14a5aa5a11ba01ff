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


def machine(k: float = 0.5, q: float = 7.0) -> Model:
    """A body with heat that is always there: it is q/k = 14 K above the room before anything runs."""
    return Model(
        "chip",
        {"k": Parameter(k, "W/K", min=0.0), "q": Parameter(q, "W", min=0.0)},
        {"T": State("T", "degC", 100.0, None, None, 1 / 100.0)},
        tuple(Term(f, "T", parse(f)) for f in ("P", "q", "k*(room - T)")),
        {"T": Name("T")},
    )


def read(k: float = 0.5, q: float = 7.0, seed: int = 1) -> Campaign:
    """Two recordings of half an hour, a reading every 5 s with a noise of 0.3 K, exact but for it."""
    time = np.arange(0.0, 1800.0, 5.0)
    found = {}
    for n, power in {"busy": 6.0, "idle": 0.0}.items():
        load = np.where(time > 60.0, power, 0.0)
        body, series = ROOM + q / k, []
        for p in load:
            series.append(body)
            rest = ROOM + (p + q) / k
            body = rest + (body - rest) * np.exp(-5.0 * k / 100.0)
        noise = np.random.default_rng([seed, len(n)]).normal(0.0, 0.3, len(time))
        found[n] = Recording(n, time, {"P": load, "room": np.full(len(time), ROOM), "T": series + noise})
    return Campaign("c", CHANNELS, found)


def exported() -> Exported:
    document = make_document(machine(), read(), ["busy", "idle"])
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
    silent = replace(campaign.recordings["idle"], values={"P": np.zeros(360), "T": np.full(360, np.nan)})
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
