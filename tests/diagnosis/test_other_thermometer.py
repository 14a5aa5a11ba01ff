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
