"""Formulas as MathML: well formed, and they read as the formula does."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from discovery.report import mathml
from discovery.terms import parse

READINGS = [
    ("G*(body - table)", "G(body−table)"),
    ("a - (b - c)", "a−(b−c)"),
    ("a/(b + 1)", "frac[a|b+1]"),
    ("(speed/600)**m", "sup[(frac[speed|600])|m]"),
    ("-a**2", "−sup[a|2]"),
    ("2.5e-7*T_env", "2.5×sup[10|−7]sub[T|env]"),
    ("abs(x)*sqrt(y)", "|x|sqrt[y]"),
    ("delay(T_fluid, 600)", "sub[T|fluid](t−600)"),
    ("lag(x, tau)", "sub[L|τ][x]"),
    ("a1*E_Y0C", "sub[a|1]sub[E|Y0C]"),
    ("where(speed > 1, a, b)", "{a if speed>1; b else}"),
    ("max(a, b)", "max(a,b)"),
]


def spoken(element: ET.Element) -> str:
    """A short reading of MathML."""
    inner = [spoken(child) for child in element]
    match element.tag:
        case "mfrac" | "msup" | "msub":
            return f"{element.tag[1:]}[{'|'.join(inner)}]"
        case "msqrt":
            return f"sqrt[{''.join(inner)}]"
        case "mtable":
            return "{" + "; ".join(inner) + "}"
        case "mtr":
            return " ".join(inner)
        case _:
            return ((element.text or "") + "".join(inner)).replace("\u2062", "").replace("if\u00a0", "if ")


@pytest.mark.parametrize(("text", "reading"), READINGS)
def test_formula(text: str, reading: str) -> None:
    markup = mathml.math(mathml.expression(parse(text))).replace("&nbsp;", "\u00a0")
    assert spoken(ET.fromstring(markup)) == reading


def test_names_are_escaped() -> None:
    assert "<b>" not in mathml.symbol("x_<b>")
