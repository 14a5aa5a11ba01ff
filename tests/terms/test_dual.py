"""Derivatives of expressions against differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from discovery.terms import evaluate, parse

SOURCES = (
    "a*x**2 + b",
    "exp(-a*x)/b",
    "log(x*b) + sqrt(x + a)",
    "tanh(a*(x - b))",
    "where(x > b, a*x, x**2)",
    "min(a*x, b, 3*x)",
    "max(x, b) - abs(x - a)",
    "x**a",
    "a**x",
    "-(x - b)*(x + a)/(x*b)",
    "abs(x - b)**0.25*(x - b)",
)


@pytest.mark.parametrize("source", SOURCES)
@settings(max_examples=40, deadline=None)
@given(st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_slopes_are_those_of_differences(source: str, x: float, a: float, b: float) -> None:
    if min(abs(x - b), abs(x - a), abs(a * x - b), abs(a - 3), abs(3 * x - b)) < 1e-2:
        return  # a kink
    values = {"x": x, "a": a, "b": b}
    expression = parse(source)
    dual = evaluate(expression, values, frozenset(values))
    for name, step in ((name, 1e-6 * values[name]) for name in values):
        up = evaluate(expression, values | {name: values[name] + step}).value
        down = evaluate(expression, values | {name: values[name] - step}).value
        slope = (float(up) - float(down)) / (2 * step)
        assert float(dual.partials.get(name, 0.0)) == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_a_quotient_by_zero_is_no_crash() -> None:
    assert not np.isfinite(evaluate(parse("1/(2 - 2)"), {}).value)
    assert not np.isfinite(evaluate(parse("a/b"), {"a": 0.0, "b": 0.0}).value)


def test_the_branch_not_taken_may_be_undefined() -> None:
    dual = evaluate(
        parse("where(x > 0, log(max(x, 1e-300)), 0)"), {"x": np.array([0.0, 1.0])}, frozenset({"x"})
    )
    assert np.isfinite(dual.value).all()


def test_a_derivative_costs_nothing_where_the_name_does_not_occur() -> None:
    assert evaluate(parse("a*x"), {"a": 1.0, "x": 2.0}, frozenset({"b"})).partials == {}
