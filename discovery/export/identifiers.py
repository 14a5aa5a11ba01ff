"""Names of a model in languages that know only ASCII, and comments that cannot end early."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence


def identifier(text: str) -> str:
    """An ASCII identifier like the text, at most 40 characters.

    >>> identifier("Öl: 5-axis")
    'Ol_5_axis'
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    word = re.sub(r"_+", "_", re.sub(r"\W", "_", plain)).strip("_")[:40]
    return word if word and not word[0].isdigit() else f"m_{word}"


def identifiers(names: Sequence[str]) -> list[str]:
    """Different identifiers for names, different also when case does not count.

    >>> identifiers(["T", "t", "T"])
    ['T', 't_2', 'T_3']
    """
    used: set[str] = set()
    found = []
    for name in names:
        word, k = identifier(name), 1
        while word.lower() in used:
            k += 1
            word = f"{identifier(name)}_{k}"
        used.add(word.lower())
        found.append(word)
    return found


def comment(text: str) -> str:
    """Text that is safe inside a comment of any target: printable ASCII on one line, no end of comment."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "replace").decode()
    plain = "".join(c if " " <= c <= "~" else " " for c in plain)
    return re.sub(r"[*?\\(){}$]", lambda m: {"*": "x", "(": "[", ")": "]"}.get(m[0], "."), plain)[:200]


def formula(text: str) -> str:
    """A formula that is safe inside a comment of C and of structured text, and still reads as a formula.

    >>> formula("G*(b - a)**2 */ (* x*)")
    'G* (b - a)**2 * / ( * x* )'
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "replace").decode()
    plain = "".join(c if " " <= c <= "~" and c not in "{}$\\?" else "." for c in plain)[:400]
    return re.sub(r"\*(?=[/()])|\((?=\*)|/(?=\*)", lambda m: f"{m[0]} ", plain)
