"""Numbers and words as they are printed."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

_RAISED = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"
_LATEX = str.maketrans(
    {
        **{c: f"\\{c}" for c in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "µ": r"\textmu{}",
        "°": r"\textdegree{}",
        "−": "$-$",
        "→": r"$\to$",
        "–": "--",
        "·": r"$\cdot$",
        "×": r"$\times$",
        "±": r"$\pm$",
        "σ": r"$\sigma$",
        "\u00a0": "~",
        "“": "``",
        "”": "''",
    }
)


def number(value: float | None, digits: int = 3) -> str:
    """A number with `digits` significant digits and a true minus sign; a dash where there is none.

    >>> number(-0.01234), number(1234.5), number(None), number(86.0)
    ('−0.0123', '1230', '–', '86')
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if 1e-4 <= abs(value) < 1e6:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        text = f"{float(f'{value:.{digits}g}'):.{decimals}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        text = f"{mantissa}·10{_superscript(int(exponent))}"
    return text.replace("-", "−")


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", _RAISED))


def latex(text: str) -> str:
    """A text of a table in LaTeX; `charts.js` does the same in the page.

    >>> latex("a_1 & b: 5 %"), latex("1.2·10⁻⁵ W/m²"), latex("–")
    ('a\\\\_1 \\\\& b: 5 \\\\%', '1.2$\\\\cdot$10$^{-5}$ W/m$^{2}$', '--')
    """
    escaped = text.translate(_LATEX)
    plain = str.maketrans(_RAISED, "-0123456789")
    return re.sub(f"[{_RAISED}]+", lambda found: f"$^{{{found[0].translate(plain)}}}$", escaped)


def percent(share: float | None) -> str:
    """A share as whole percent, never a rounded-up certainty.

    >>> percent(0.997), percent(0.5), percent(1.0)
    ('> 99 %', '50 %', '> 99 %')
    """
    if share is None or not math.isfinite(share):
        return "–"
    if share > 0.99:
        return "> 99 %"
    return f"{100 * share:.0f} %"


def listed(words: Sequence[str], last: str = "and") -> str:
    """Words as a sentence lists them.

    >>> listed(["a", "b", "c"])
    'a, b and c'
    """
    return f"{', '.join(words[:-1])} {last} {words[-1]}" if len(words) > 1 else "".join(words)


def with_unit(name: str, unit: str) -> str:
    """A quantity with its unit, as axes and heads of columns say it.

    >>> with_unit("E_Y0C", "µm")
    'E_Y0C [µm]'
    """
    return f"{name} [{unit or '-'}]"


def words(identifier: str) -> str:
    """A word of the catalogue as plain words.

    >>> words("flooded_gap")
    'flooded gap'
    """
    return identifier.replace("_", " ")
