"""The functions and function blocks of a structured text, taken apart for other spellings of it."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Variable:
    """A variable of a unit; `last`: last index of an array."""

    section: str  # VAR_INPUT, VAR_OUTPUT, VAR
    name: str
    type: str
    last: int | None
    initial: str | None
    comment: str


@dataclass(frozen=True)
class Unit:
    """A FUNCTION (with the type that it returns) or a FUNCTION_BLOCK."""

    kind: str
    name: str
    returns: str | None
    variables: tuple[Variable, ...]
    body: str


_UNIT = re.compile(r"^(FUNCTION_BLOCK|FUNCTION) (\w+)(?: : (\w+))?\n(.*?)^END_\1", re.DOTALL | re.MULTILINE)
_SECTION = re.compile(
    r"^\s*(VAR_INPUT|VAR_OUTPUT|VAR)\b(?: \(\*.*?\*\))?(.*?)END_VAR", re.DOTALL | re.MULTILINE
)
_VARIABLE = re.compile(
    r"(\w+) : (?:ARRAY \[0\.\.(\d+)\] OF )?(\w+)(?: := (\w+))?;(?:[ \t]*\(\*[ ]?(.*?)[ ]?\*\))?"
)


def units(text: str) -> list[Unit]:
    """The units of a text that `block.py` wrote, in order."""
    found = []
    for kind, name, returns, inside in _UNIT.findall(text):
        variables = [
            Variable(section, word, base, int(last) if last else None, initial or None, said)
            for section, lines in _SECTION.findall(inside)
            for word, last, base, initial, said in _VARIABLE.findall(lines)
        ]
        body = inside[inside.rindex("END_VAR") + len("END_VAR") :].strip("\n")
        found.append(Unit(kind, name, returns or None, tuple(variables), body))
    return found
