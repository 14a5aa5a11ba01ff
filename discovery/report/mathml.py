"""Formulas as MathML, as they would stand in a paper."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from html import escape

from discovery.terms import Apply, Expression, Name, Number
from discovery.terms import text as plain

_GREEK = {
    "alpha": "α",
    "beta": "β",
    "gamma": "γ",
    "delta": "δ",
    "eps": "ε",
    "epsilon": "ε",
    "eta": "η",
    "theta": "θ",
    "kappa": "κ",
    "lam": "λ",
    "lambda": "λ",
    "mu": "μ",
    "nu": "ν",
    "xi": "ξ",
    "rho": "ρ",
    "sigma": "σ",
    "tau": "τ",
    "phi": "φ",
    "omega": "ω",
    "Omega": "Ω",
    "Delta": "Δ",
}
_LEVEL = {
    "<": 1,
    "<=": 1,
    ">": 1,
    ">=": 1,
    "==": 1,
    "!=": 1,
    "+": 2,
    "-": 2,
    "*": 3,
    "/": 6,
    "neg": 4,
    "**": 5,
}
_SIGN = {"<": "&lt;", "<=": "≤", ">": "&gt;", ">=": "≥", "==": "=", "!=": "≠", "+": "+", "-": "−"}


def math(*parts: str, block: bool = False) -> str:
    """A <math> element."""
    attribute = ' display="block"' if block else ""
    return f"<math{attribute}><mrow>{''.join(parts)}</mrow></math>"


def symbol(name: str) -> str:
    """A name as a symbol: what follows the first underscore is an upright index.

    >>> symbol("T_env")
    '<msub><mi>T</mi><mtext>env</mtext></msub>'
    """
    head, _, index = name.partition("_")
    if not index and (numbered := re.fullmatch(r"([A-Za-z]+?)(\d+)", name)):
        head, index = numbered[1], numbered[2]
    head = _GREEK.get(head, head)
    body = f"<mi>{escape(head)}</mi>" if len(head) == 1 else f'<mi mathvariant="normal">{escape(head)}</mi>'
    if not head:
        return f'<mi mathvariant="normal">{escape(name)}</mi>'
    return f"<msub>{body}<mtext>{escape(index.replace('_', ' '))}</mtext></msub>" if index else body


def number(value: float) -> str:
    """A number with at most four significant digits, powers of ten written out."""
    text = f"{value:.4g}"
    if "e" not in text:
        return _signed(text)
    mantissa, exponent = text.split("e")
    power = f"<msup><mn>10</mn>{_signed(str(int(exponent)))}</msup>"
    return power if mantissa == "1" else f"{_signed(mantissa)}<mo>×</mo>{power}"


def _signed(text: str) -> str:
    return f"<mrow><mo>−</mo><mn>{text[1:]}</mn></mrow>" if text.startswith("-") else f"<mn>{text}</mn>"


def temperature(body: str) -> str:
    """The temperature of a body: T with the body as index."""
    return (
        symbol(body)
        if body.startswith(("T_", "T")) and len(body) < 4
        else f"<msub><mi>T</mi><mtext>{escape(body.replace('_', ' '))}</mtext></msub>"
    )


def bracketed(body: str) -> str:
    """A body in round brackets, which grow only around what is taller than a line."""
    grows = "" if any(f"<{tall}" in body for tall in ("mfrac", "mtable", "msup")) else ' stretchy="false"'
    return f"<mrow><mo{grows}>(</mo>{body}<mo{grows}>)</mo></mrow>"


def expression(tree: Expression, symbols: Mapping[str, str] | None = None) -> str:
    """MathML of an expression tree; `symbols` gives names a symbol of their own."""
    return _write(tree, symbols or {})[0]


def lines(tree: Expression, symbols: Mapping[str, str] | None = None, room: int = 44) -> list[str]:
    """MathML of an expression, broken between factors and within cases; a line has about `room` characters.

    >>> from discovery.terms import parse
    >>> [len(lines(parse(text), room=12)) for text in ("a*b*c", "alpha*beta*gamma*delta", "a + b")]
    [1, 2, 1]
    """
    signs = symbols or {}
    factors = _factors(tree)
    if extent(tree) > room and isinstance(tree, Apply) and tree.function in ("+", "-"):
        left, right = tree.arguments
        body = expression(right, signs)
        if tree.function == "-" and getattr(right, "function", "") in ("+", "-"):
            body = bracketed(body)
        return [*lines(left, signs, room), f"<mo form='infix'>{_SIGN[tree.function]}</mo><mrow>{body}</mrow>"]
    if extent(tree) <= room or (len(factors) == 1 and not _is_where(tree)):
        return [expression(tree, signs)]
    if _is_where(tree):
        assert isinstance(tree, Apply)
        condition, then, other = tree.arguments
        cases = [stacked(lines(one, signs, room)) for one in (then, other)]
        return [_cases(f"<mrow>{expression(condition, signs)}</mrow>", *cases)]
    found, length = [""], 0
    for index, factor in enumerate(factors):
        part = lines(factor, signs, room) if _is_where(factor) else [_write(factor, signs)[0]]
        body = "".join(part)
        if not _is_where(factor) and _write(factor, signs)[1] < (5 if index else 3):
            body = bracketed(body)
        size = extent(factor)
        if index and length + size > room:
            found.append("<mo form='infix'>·</mo>")
            length = 0
        elif index and isinstance(factor, Number):
            body = f"<mo>·</mo>{body}"
        elif index:
            body = f"<mspace width='0.17em'/>{body}"
        found[-1] += f"<mrow>{body}</mrow>"
        length += size
    return found


def extent(tree: Expression) -> int:
    """About how many characters wide an expression is printed; a fraction is as wide as its longer part.

    >>> from discovery.terms import parse
    >>> extent(parse("a*b")), extent(parse("(a + b)/300"))
    (3, 5)
    """
    match tree:
        case Apply(function="/", arguments=arguments):
            return max(map(extent, arguments))
        case Apply(function=function, arguments=arguments):
            sign = {"**": 0, "*": 1, "neg": 1}.get(function, 3 if function in _SIGN else len(function) + 2)
            return sum(map(extent, arguments)) + sign
    if isinstance(tree, Name):  # an index is smaller
        return 1 + round(0.7 * (len(tree.id) - 1))
    return len(plain(tree))


def stacked(rows: list[str]) -> str:
    """Lines of MathML one below the other."""
    if len(rows) == 1:
        return f"<mrow>{rows[0]}</mrow>"
    return f'<mtable class="lines">{"".join(f"<mtr><mtd>{row}</mtd></mtr>" for row in rows)}</mtable>'


def _factors(tree: Expression) -> list[Expression]:
    """The factors of a product, left to right."""
    if isinstance(tree, Apply) and tree.function == "*":
        left, right = tree.arguments
        return [*_factors(left), *_factors(right)]
    return [tree]


def _is_where(tree: Expression) -> bool:
    return isinstance(tree, Apply) and tree.function == "where"


def _write(tree: Expression, symbols: Mapping[str, str]) -> tuple[str, int]:
    """MathML and how tightly it binds."""

    def row(inner: Expression) -> str:
        return f"<mrow>{_write(inner, symbols)[0]}</mrow>"

    def within(inner: Expression, level: int) -> str:
        text, own = _write(inner, symbols)
        return bracketed(text) if own < level else f"<mrow>{text}</mrow>"

    match tree:
        case Number(value=value):
            text = number(value)
            return text, 3 if "×" in text else 4 if value < 0 else 6
        case Name(id=name):
            return symbols.get(name) or ("<mi>t</mi>" if name == "time" else symbol(name)), 6
        case Apply(function="neg", arguments=(inner,)):
            return f"<mrow><mo>−</mo>{within(inner, 3)}</mrow>", 4
        case Apply(function="/", arguments=(above, below)):
            return f"<mfrac>{row(above)}{row(below)}</mfrac>", 5
        case Apply(function="**", arguments=(base, power)):
            return f"<msup>{within(base, 6)}{row(power)}</msup>", 5
        case Apply(function="*", arguments=(left, right)):
            between = "<mo>·</mo>" if isinstance(right, Number) else "<mo>\u2062</mo><mspace width='0.17em'/>"
            product = isinstance(right, Apply) and right.function == "*"
            return f"{within(left, 3)}{between}{within(right, 3 if product else 5)}", 3
        case Apply(function=function, arguments=(left, right)) if function in _SIGN:
            level = _LEVEL[function]
            return (
                f"{within(left, level)}<mo>{_SIGN[function]}</mo>{within(right, level + (function == '-'))}",
                level,
            )
        case Apply(function=function, arguments=arguments):
            return _FUNCTIONS.get(function, _called(function))(*(row(a) for a in arguments)), 6
    raise AssertionError(tree)


def _called(function: str) -> Callable[..., str]:
    def write(*arguments: str) -> str:
        inside = "<mo>,</mo>".join(arguments)
        return f"<mrow><mi>{escape(function)}</mi><mo>(</mo>{inside}<mo>)</mo></mrow>"

    return write


def _cases(condition: str, then: str, other: str) -> str:
    first = f"<mtr><mtd>{then}</mtd><mtd><mtext>if&nbsp;</mtext>{condition}</mtd></mtr>"
    second = f"<mtr><mtd>{other}</mtd><mtd><mtext>else</mtext></mtd></mtr>"
    return f'<mtable class="cases">{first}{second}</mtable>'


_FUNCTIONS: dict[str, Callable[..., str]] = {
    "abs": lambda x: f"<mrow><mo>|</mo>{x}<mo>|</mo></mrow>",
    "exp": lambda x: f"<msup><mi>e</mi>{x}</msup>",
    "log": lambda x: f"<mrow><mi>ln</mi><mo>(</mo>{x}<mo>)</mo></mrow>",
    "sqrt": lambda x: f"<msqrt>{x}</msqrt>",
    "sign": lambda x: f"<mrow><mi>sgn</mi><mo>(</mo>{x}<mo>)</mo></mrow>",
    "where": _cases,
    "delay": lambda x, s: f"<mrow>{x}<mo>(</mo><mi>t</mi><mo>−</mo>{s}<mo>)</mo></mrow>",
    "lag": lambda x, tau: f"<mrow><msub><mi>L</mi>{tau}</msub><mo>[</mo>{x}<mo>]</mo></mrow>",
    "play": lambda x, w: f"<mrow><msub><mi>P</mi>{w}</msub><mo>[</mo>{x}<mo>]</mo></mrow>",
}
