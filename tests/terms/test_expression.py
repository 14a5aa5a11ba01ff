"""The grammar of model files: everything in it survives printing, nothing outside it parses."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from discovery.errors import UserError
from discovery.naming import FUNCTIONS
from discovery.terms import Apply, Expression, Name, Number, degree, evaluate, names, parse, substitute, text
from discovery.terms.parsing import MAX_DEPTH, MAX_LENGTH

VARIABLES = ("x", "y", "T_fluid")
VALUES = {
    "x": np.array([0.3, 1.7, -2.0]),
    "y": np.array([1.0, 0.5, 4.0]),
    "T_fluid": np.array([20.0, 25.0, -1.0]),
}
BINARY = ("+", "-", "*", "/", "**", "<", "<=", ">", ">=", "==", "!=")

leaves = st.one_of(
    st.floats(-1e6, 1e6, allow_nan=False).map(lambda value: Number(value + 0.0)),  # 0 has no sign
    st.sampled_from(VARIABLES).map(Name),
)


def applied(children: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    def of(function: str, count: int) -> st.SearchStrategy[Apply]:
        return st.tuples(*[children] * count).map(lambda arguments: Apply(function, arguments))

    plain = [name for name in FUNCTIONS if name not in ("delay", "lag", "play")]
    calls = [of(name, FUNCTIONS[name][0]) for name in plain]
    minus = of("neg", 1).filter(
        lambda tree: not isinstance(tree.arguments[0], Number)
    )  # a negative number is one
    return st.one_of(*(of(name, 2) for name in BINARY), minus, *calls)


expressions = st.recursive(leaves, applied, max_leaves=12)


@settings(max_examples=400, deadline=None)
@example(Apply("log", (Apply("**", (Number(0.0), Number(1.0))),)))
@given(expressions)
def test_what_is_printed_reads_back_to_the_same_values(expression: Expression) -> None:
    again = parse(text(expression))
    with np.errstate(all="ignore"):
        assert np.array_equal(
            evaluate(again, VALUES).value, evaluate(expression, VALUES).value, equal_nan=True
        )
    assert names(again) == names(expression)


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_read_or_refused_with_a_sentence(source: str) -> None:
    try:
        found: object = parse(source, "model.toml, line 3")
    except UserError as error:
        found = str(error)
    assert isinstance(found, Number | Name | Apply) or str(found).startswith("model.toml, line 3: ")


@pytest.mark.parametrize(
    "source",
    [
        "__import__('os').system('true')",
        "().__class__",
        "x.real",
        "x[0]",
        "[x for x in y]",
        "lambda: 0",
        "x if y else 0",
        "x and y",
        "not x",
        "x // 2",
        "x % 2",
        "x @ y",
        "x << 2",
        "~x",
        "'text'",
        "True",
        "None",
        "1j",
        "f'{x}'",
        "(x := 2)",
        "eval(x)",
        "exp(x=1)",
        "exp(*y)",
        "exp()",
        "where(x, y)",
        "delay(x + y, 600)",
        "1e999",
        "x; y",
        "x = 1",
        "",
    ],
)
def test_nothing_else_parses(source: str) -> None:
    with pytest.raises(UserError):
        parse(source)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("min(x)", "takes 2 to 8 arguments"),
        ("where(x, y)", "takes 3 arguments"),
        ("exp()", "takes 1 argument,"),
        ("1if x else 2", "not allowed"),
        ("2*ﬁx", "'ﬁ' in '2.ﬁx' is no ASCII letter"),  # would be read as fix
        ("x − y", "'−' in 'x − y' is no ASCII letter or sign"),
    ],
)
@pytest.mark.filterwarnings("error")  # Python's own parser must not speak beside ours
def test_the_sentence_says_what_is_allowed(source: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        parse(source)


@pytest.mark.parametrize(
    "bomb",
    [
        "(" * 1900 + "x" + ")" * 1900,
        "-" * 3900 + "x",
        "+".join(["x"] * 1900),
        "exp(" * 900 + "x" + ")" * 900,
        "x**" * 1000 + "x",
        "x" * (MAX_LENGTH + 1),
        "not " * 900 + "x",
    ],
)
def test_what_is_too_large_is_refused(bomb: str) -> None:
    with pytest.raises(UserError):
        parse(bomb)


def test_a_tower_of_powers_is_harmless() -> None:
    value = evaluate(parse("9**9**9**9"), {}).value
    assert np.isinf(value)


def test_the_deepest_expression_that_is_read_can_be_printed_and_evaluated() -> None:
    source = "exp(" * (MAX_DEPTH - 1) + "x*0" + ")" * (MAX_DEPTH - 1)
    assert text(parse(source)) == source
    assert np.isfinite(evaluate(parse(source), VALUES).value).all()


def test_signs_and_powers_bind_as_in_python() -> None:
    for source in (
        "-x**2",
        "(-x)**2",
        "2**-x",
        "-x*-y",
        "x - (y - T_fluid)",
        "x/(y*T_fluid)",
        "x**y**2",
        "(x**y)**2",
    ):
        with np.errstate(all="ignore"):
            expected = eval(source, {}, dict(VALUES))  # the oracle; the product never evaluates text
            assert np.allclose(evaluate(parse(source), VALUES).value, expected, equal_nan=True), source


def test_comparisons_chain_and_count_as_numbers() -> None:
    assert evaluate(parse("(0 < x < 1) + 2*(y >= 1)"), VALUES).value.tolist() == [3.0, 0.0, 2.0]  # type: ignore[union-attr]


def test_degree_tells_affine_terms_from_others() -> None:
    states = frozenset({"x", "y"})
    assert [
        degree(parse(s), states)
        for s in ("T_fluid**2", "T_fluid*(x - y)", "x*y", "where(T_fluid > 1, x, y)", "abs(x)")
    ] == [0, 1, 2, 1, 2]


def test_substitution_leaves_the_rest() -> None:
    assert text(substitute(parse("a*(x - y)"), {"a": parse("b + 1"), "y": Number(2.0)})) == "(b + 1)*(x - 2)"
