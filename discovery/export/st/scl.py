"""SCL (Siemens S7-1200 and S7-1500) of the function block, as an external source for TIA Portal.

Written after Siemens' rules: local names with #, names of blocks in quotes, arguments of functions by name,
`**` for powers. No Siemens compiler was at hand: the text is read back and replayed by the workbench alone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from discovery.export.document import Exported
from discovery.export.st.block import st_text
from discovery.export.st.units import Unit, Variable, units

_TOKEN = re.compile(
    r"\(\*.*?\*\)|(?:LREAL|REAL)#[\d.]+(?:[eE][+-]?\d+)?|[A-Za-z_]\w*|\s+|\d+|:=|<>|<=|>=|.", re.DOTALL
)
_SELECT = ("G", "IN0", "IN1")


def scl_text(exported: Exported, precision: str = "double") -> str:
    """The functions and function blocks of a model; generate blocks from it as an external source."""
    text = st_text(exported, precision)
    parts = units(text)
    head = text[: text.index("*)") + 2]
    arguments = {u.name: [v.name for v in u.variables if v.section == "VAR_INPUT"] for u in parts}
    return head + "\n\n" + "\n\n".join(_unit(unit, arguments) for unit in parts) + "\n"


def _unit(unit: Unit, arguments: Mapping[str, list[str]]) -> str:
    returns = f" : {unit.returns}" if unit.returns else ""
    lines = [f'{unit.kind} "{unit.name}"{returns}', "{ S7_Optimized_Access := 'TRUE' }", "VERSION : 0.1"]
    for section in ("VAR_INPUT", "VAR_OUTPUT", "VAR"):
        found = [v for v in unit.variables if v.section == section]
        if found:
            word = "VAR_TEMP" if section == "VAR" and unit.kind == "FUNCTION" else section
            lines += [f"  {word}", *(_declaration(v, arguments) for v in found), "  END_VAR"]
    names = {v.name for v in unit.variables} | {unit.name}
    return "\n".join([*lines, "BEGIN", _body(unit.body, names, arguments), f"END_{unit.kind}"])


def _declaration(v: Variable, arguments: Mapping[str, list[str]]) -> str:
    base = f'"{v.type}"' if v.type in arguments else v.type
    base = f"ARRAY [0..{v.last}] OF {base}" if v.last is not None else base
    initial = f" := {v.initial}" if v.initial else ""
    return f"    {v.name} : {base}{initial};" + (f" // {v.comment}" if v.comment else "")


def _body(text: str, names: set[str], arguments: Mapping[str, list[str]]) -> str:
    return _Writer(_TOKEN.findall(text), names, arguments).all()


class _Writer:
    def __init__(self, tokens: list[str], names: set[str], arguments: Mapping[str, list[str]]) -> None:
        self.tokens, self.names, self.arguments, self.at = tokens, names, arguments, 0

    def all(self) -> str:
        found = []
        while self.at < len(self.tokens):
            found.append(self.one())
        return "".join(found)

    def one(self) -> str:
        """The next token as SCL writes it; a call with all its arguments."""
        token = self.tokens[self.at]
        self.at += 1
        following = self.tokens[self.at] if self.at < len(self.tokens) else ""
        if token.startswith("(*"):
            return f"// {token[2:-2].strip()}"
        if following == "(" and (token in self.arguments or token in ("SEL", "EXPT")):
            return self.call(token)
        if following == "(" and token in self.names:
            return self.instance(token)
        if token == ".":  # a member of an instance keeps its plain name
            self.at += 1
            return f".{following}"
        if token in self.names:
            return f"#{token}"
        return token

    def call(self, name: str) -> str:
        given = self.given()
        if name == "EXPT":
            return f"(({given[0]}) ** ({given[1]}))"
        words = _SELECT if name == "SEL" else self.arguments[name]
        inside = ", ".join(f"{word} := {value}" for word, value in zip(words, given, strict=True))
        return f"{name if name == 'SEL' else chr(34) + name + chr(34)}({inside})"

    def given(self) -> list[str]:
        """Arguments by place; the parenthesis after them is passed."""
        self.at += 1
        found: list[str] = []
        depth, word = 0, ""
        while True:
            token = self.tokens[self.at]
            if token == ")" and depth == 0:
                self.at += 1
                return [*found, word.strip()]
            if token == "," and depth == 0:
                self.at += 1
                found.append(word.strip())
                word = ""
                continue
            before = self.at
            word += self.one()
            if self.at == before + 1:  # a call passes its own parentheses
                depth += (token == "(") - (token == ")")

    def instance(self, name: str) -> str:
        """A call of an instance: its arguments have names already, which are kept."""
        self.at += 1
        word, depth = f"#{name}(", 1
        while depth:
            token = self.tokens[self.at]
            if re.fullmatch(r"[A-Za-z_]\w*", token) and self.tokens[self.at + 1 : self.at + 3] == [" ", ":="]:
                word += token
                self.at += 1
                continue
            before = self.at
            word += self.one()
            if self.at == before + 1:
                depth += (token == "(") - (token == ")")
        return word
