"""Another recorded thermometer: a neighbour that heats a body, or one that reads the same body."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.diagnosis import diagnose
from discovery.diagnosis.document import document
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CAPACITY, EXCHANGE, STEP = 500.0, 2.0, 10.0  # J/K, W/K, s
NOISE = 0.05, 0.01  # K, of the thermometer that the model predicts and of the other one


def follows(values: np.ndarray, time_constant: float) -> np.ndarray:
    """A first-order follower of a held input, from its balance at zero."""
    fade, y = np.exp(-STEP / time_constant), np.zeros(len(values))
    for k in range(1, len(values)):
        y[k] = fade * y[k - 1] + (1 - fade) * values[k - 1]
    return y


def recording(power: np.ndarray, seed: int, name: str, same: bool) -> Recording:
    """A heated body and a second thermometer: on the same body, or on a neighbour that heats the body."""
    rng = np.random.default_rng(seed)
    draught = np.repeat(rng.normal(0.0, 4.0, len(power) // 20), 20)  # W, which nothing records
    heated = follows((power + draught) / EXCHANGE, CAPACITY / EXCHANGE)
    body, other = (heated, heated) if same else (follows(heated, CAPACITY / (2 * EXCHANGE)) / 2, heated)
    pair = zip((body, other), NOISE, strict=True)
    body, other = (22.0 + x + rng.normal(0.0, noise, len(x)) for x, noise in pair)
    data = {"P": power, "air": np.full(len(power), 22.0), "body": body, "other": other}
    return Recording(name, STEP * np.arange(float(len(power))), data)


@pytest.mark.parametrize(("same", "cause"), [(True, "P"), (False, "other")])
def test_what_reads_the_same_body_does_not_heat_it(same: bool, cause: str) -> None:
    """The model has no heat. A thermometer on the same body explains it best, and is no cause."""
    first = np.repeat([0.0, 40.0, 10.0, 60.0, 0.0], 60)
    second = np.repeat([20.0, 0.0, 50.0, 5.0, 30.0], 60)
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "air": Channel("air", "ambient temperature", "degC", None, "linear"),
        "body": Channel("body", "temperature", "degC", None, "linear"),
        "other": Channel("other", "temperature", "degC", None, "linear"),
    }
    runs = {"a": recording(first, 1, "a", same), "b": recording(second, 2, "b", same)}
    unheated = Model(
        "body",
        {"hA": Parameter(EXCHANGE, "W/K", 0.0)},
        {"body": State("body", "degC", CAPACITY, parse("air"), scale=1.0 / CAPACITY)},
        (Term("air", "body", parse("hA*(air - body)")),),
        {},
    )
    answer = document(diagnose(unheated, Campaign("body", channels, runs), ["a", "b"], (), ["body"]))
    assert [(p.effect, p.channels) for p in answer.physics] == [("input_heat", [cause])]


def test_a_path_that_joins_two_readings_at_once_is_no_path() -> None:
    """The model predicts both thermometers and heats the second one alone. Both read the same body: a path
    without end between them explains the first as well as its heat does, and is no path.
    """
    first = np.repeat([0.0, 40.0, 10.0, 60.0, 0.0], 60)
    second = np.repeat([20.0, 0.0, 50.0, 5.0, 30.0], 60)
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "air": Channel("air", "ambient temperature", "degC", None, "linear"),
        "body": Channel("body", "temperature", "degC", NOISE[0], "linear"),
        "other": Channel("other", "temperature", "degC", NOISE[1], "linear"),
    }
    runs = {"a": recording(first, 1, "a", same=True), "b": recording(second, 2, "b", same=True)}
    states = {n: State(n, "degC", CAPACITY, parse("air"), scale=1.0 / CAPACITY) for n in ("body", "other")}
    terms = (
        Term("heat", "other", parse("P")),
        Term("air at body", "body", parse("hA*(air - body)")),
        Term("air at other", "other", parse("hB*(air - other)")),
    )
    sizes = {name: Parameter(EXCHANGE, "W/K", 0.0) for name in ("hA", "hB")}
    answer = document(
        diagnose(Model("two", sizes, states, terms, {}), Campaign("two", channels, runs), ["a", "b"])
    )
    assert {("input_heat", "body")} <= {(p.effect, *p.states) for p in answer.physics}
    assert "conduction_path" not in {p.effect for p in answer.physics}


ROOMS, PATH, LOSS, GAINS = ("east", "west"), 2.6e-4, 1e-5, (1e-3, 2e-4)  # 1/s, 1/s, K/s


def rooms(name: str, seed: int) -> Recording:
    """Two rooms with a door between them, heated at other hours, read each hour for four days."""
    rng, hours, fine = np.random.default_rng(seed), 96, 60
    heats = np.repeat(rng.uniform(0.0, 1.0, (hours // 4, 2)), 4, axis=0)
    out = 5.0 + 5.0 * np.sin(2 * np.pi * np.arange(hours) / 24.0 + seed)
    warm, now = np.full((hours, 2), 20.0), np.full(2, 20.0)
    for k in range(1, hours):
        for part in range(fine):
            outside = out[k - 1] + (out[k] - out[k - 1]) * part / fine
            flows = GAINS * heats[k - 1] + LOSS * (outside - now) + PATH * (now[::-1] - now)
            now = now + 3600.0 / fine * flows
        warm[k] = now
    read = np.round(warm + rng.normal(0.0, 0.05, warm.shape), 2)
    data = {"out": out, **{f"P_{r}": heats[:, k] for k, r in enumerate(ROOMS)}}
    data |= {r: read[:, k] for k, r in enumerate(ROOMS)}
    return Recording(name, 3600.0 * np.arange(float(hours)), data)


def test_a_path_may_be_about_as_fast_as_readings_come() -> None:
    """Five sixths of a difference are gone at the next reading. A second mass at one room and heat in the
    other, which follows the heater of the first, look the same to first order.
    """
    channels = {"out": Channel("out", "ambient temperature", "degC", None, "linear")}
    channels |= {f"P_{r}": Channel(f"P_{r}", "heat load", "W", None, "held") for r in ROOMS}
    channels |= {r: Channel(r, "temperature", "degC", None, "linear") for r in ROOMS}
    heats = (Term(f"heat {r}", r, parse(f"p_{r}*P_{r}")) for r in ROOMS)
    losses = (Term(f"loss {r}", r, parse(f"l_{r}*(out - {r})")) for r in ROOMS)
    sizes = {f"p_{r}": Parameter(5e-4, "K/s", 0.0) for r in ROOMS}
    sizes |= {f"l_{r}": Parameter(2e-5, "1/s", 0.0) for r in ROOMS}
    states = {r: State(r, "degC", None, parse("out + 10")) for r in ROOMS}
    model, runs = (
        Model("rooms", sizes, states, (*heats, *losses), {}),
        {n: rooms(n, k) for k, n in enumerate("ab")},
    )
    answer = document(diagnose(model, Campaign("rooms", channels, runs), list(runs)))
    assert [(p.effect, set(p.states)) for p in answer.physics] == [("conduction_path", set(ROOMS))]
