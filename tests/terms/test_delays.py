"""A delay of a formula against the formula at an earlier instant."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.terms import delays_at, evaluate, parse, substitute, text

Array = NDArray[np.float64]
TIME = np.linspace(0.0, 5000.0, 41)
CONSTANTS = {"gain": 1.7, "late": 250.0}


def channels(time: Array) -> dict[str, Array]:
    return {"u": 20 + np.sin(time / 700), "v": np.cos(time / 300)}


class Past:
    """Channels of which every instant is known."""

    def delayed(self, channel: str, seconds: float) -> tuple[Array, Array]:
        return channels(TIME - seconds)[channel], np.zeros_like(TIME)

    def lagged(self, value: Array, time_constant: float) -> Array:
        raise NotImplementedError

    def play(self, value: Array, width: float) -> tuple[Array, NDArray[np.intp], Array]:
        raise NotImplementedError


def at(source: str, time: Array) -> Array:
    known: dict[str, float | Array] = {**channels(time), **CONSTANTS, "time": time}
    return np.asarray(evaluate(parse(source), known, memory=Past()).value)


@pytest.mark.parametrize(
    "formula", ["u", "gain*u + v**2", "u + gain*where(time > 1000, sign(v), 0)", "-u/(2 + tanh(time/900))"]
)
def test_a_delay_of_a_formula_is_the_formula_of_a_while_ago(formula: str) -> None:
    late = delays_at({"u", "v"}, substitute(parse("3*delay(x, late + 60) - x"), {"x": parse(formula)}))
    assert np.allclose(at(text(late), TIME), 3 * at(formula, TIME - 310.0) - at(formula, TIME))


def test_delays_of_delays_add_up() -> None:
    late = parse("delay(x, late)")
    for _ in range(2):
        late = substitute(late, {"x": parse("delay(x, 40)")})
    expression = delays_at({"u"}, substitute(late, {"x": parse("u")}))
    assert np.allclose(at(text(expression), TIME), channels(TIME - 330.0)["u"])


def test_what_remembers_is_fed_late() -> None:
    late = substitute(parse("delay(x, late)"), {"x": parse("lag(u, gain) + play(u*v, 2)")})
    assert (
        text(delays_at({"u", "v"}, late))
        == "lag(delay(u, late), gain) + play(delay(u, late)*delay(v, late), 2)"
    )


def test_nothing_else_is_touched() -> None:
    plain = parse("gain*delay(u, late)*(v - time) + lag(u, 30)")
    assert delays_at({"u", "v"}, plain) == plain
