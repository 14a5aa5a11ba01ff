"""A logger that was off for a time: nobody knows what the inputs did, and what they did is no event."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis import diagnose
from discovery.dynamics import make_grid, make_system, simulate
from discovery.dynamics.gaps import sentences, unknown_in_gaps
from discovery.dynamics.samples import Samples
from discovery.fitting.impulses import inputs_in_gaps
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.diagnosis.parts import document
from tests.machine import campaign, model, simulated

Array = NDArray[np.float64]
EVERY, GAP, SPAN = 60.0, 3600.0, 86400.0
OFF, ON = 36000.0, 46800.0  # s, of the logger


def with_gap(linear: bool) -> Samples:
    """A sine of six hours, without an hour in the middle."""
    time = np.arange(0.0, SPAN + 1, EVERY)
    time = time[(time <= SPAN / 2) | (time >= SPAN / 2 + GAP)]
    return Samples(time, np.sin(2 * np.pi * time / 21600.0), linear)


@pytest.mark.parametrize("linear", [False, True])
def test_a_channel_is_as_unsure_as_it_moves_elsewhere(linear: bool) -> None:
    """1 - cos(w G/2) for a held sine of unit size, (1 - cos(w G/2))^2/2 for a straight one."""
    apart = 1.0 - np.cos(2 * np.pi * 0.5 * GAP / 21600.0)
    unknown = unknown_in_gaps(with_gap(linear))
    assert unknown is not None
    size = unknown.at(np.array([SPAN / 4, SPAN / 2 + GAP / 2, 0.75 * SPAN]))
    assert size[[0, 2]].tolist() == [0.0, 0.0]
    assert size[1] ** 2 == pytest.approx(GAP * (apart**2 / 2 if linear else apart), rel=0.1)


def test_what_is_written_when_it_changes_has_no_gaps() -> None:
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.exponential(600.0, 100))
    assert unknown_in_gaps(Samples(time, rng.uniform(size=100), False)) is None


def test_what_came_early_in_a_gap_has_flowed_on() -> None:
    """White noise of density s at a body with a time constant t: s/C^2 t/2 (1 - exp(-2 G/t))."""
    capacity, loss = 5000.0, 5.0
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "body": Channel("body", "temperature", "degC", 0.1, "linear"),
    }
    samples = with_gap(linear=False)
    recording = Recording("r", samples.time, {"P": samples.value, "body": np.zeros(len(samples.time))})
    grid = make_grid(Campaign("one", channels, {"r": recording}), "r", ["P"], ["body"])
    terms = Term("power", "body", parse("P")), Term("loss", "body", parse("-hA*body"))
    states = {"body": State("body", "degC", capacity, parse("0"), 0.3, 1 / capacity)}
    one = Model("one", {"hA": Parameter(loss, "W/K", 0.0)}, states, terms, {})
    run = simulate(make_system(one, grid), {"hA": loss, "start_body": 0.0} | one.values("r"))
    found = inputs_in_gaps(run)[:, 0, 0]
    density, tau = grid.silent["P"].value.max() ** 2, capacity / loss
    assert np.flatnonzero(found).tolist() == [int(np.argmax(np.diff(samples.time)))]
    expected = density / capacity**2 * tau / 2 * (1.0 - np.exp(-2 * GAP / tau))
    assert found.max() == pytest.approx(expected, rel=0.15)  # half of it at each end of a step


def without_rows(recording: Recording) -> Recording:
    kept = (recording.time <= OFF) | (recording.time >= ON)
    values = {name: series[kept] for name, series in recording.values.items()}
    return replace(recording, time=recording.time[kept], values=values)


def test_what_inputs_did_meanwhile_is_no_event() -> None:
    """The drive stopped while the logger was off."""
    runs = [without_rows(simulated(k, hours=24.0)) for k in (1, 2)]
    last = [float(r.values["P_drive"][np.searchsorted(r.time, at)]) for r in runs for at in (OFF, ON)]
    assert last[0] != last[1] or last[2] != last[3]  # it switched
    answer = document(diagnose(model(), campaign(*runs), ["r1", "r2"]))
    assert (answer["verdict"], answer["physics"]) == ("no mismatch", [])


def test_the_longest_gap_is_said() -> None:
    unknown = unknown_in_gaps(with_gap(linear=False))
    assert unknown is not None
    assert sentences({"a": {"P": unknown, "speed": unknown}, "b": {}}) == [
        "what P, speed did in a from 12 to 13 h is not recorded; the fit allows for it"
    ]
    short = replace(unknown, time=unknown.time / 3600.0)
    assert "did in a from 12 to 13 s is not recorded" in sentences({"a": {"P": short}})[0]
