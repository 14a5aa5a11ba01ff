"""Doubtful guesses as questions: on the terminal where there is one, else as words in the campaign file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from discovery.errors import UsageError
from discovery.firsthour.guess import SURE, Guess
from discovery.firsthour.measures import TIME_UNITS, time_unit, unit_of
from discovery.firsthour.table import Column
from discovery.recordings.roles import ROLES
from discovery.recordings.units import UnitError, conversion
from discovery.schema import suggest

_MOST = 4  # answers that are offered


@dataclass(frozen=True)
class Question:
    """`about`: column. `answers`: what is offered, the likeliest first: words, role, unit."""

    about: str
    text: str
    answers: tuple[tuple[str, str, str], ...]


Ask = Callable[[Question], int]
"""Which of the answers a person chose."""


def questions(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> list[Question]:
    """One for each doubtful column."""
    found = []
    for column in columns:
        one = guesses[column.name]
        if one.sure:
            continue
        roles = [(one.role, one.chance), *one.rivals] if one.chance < SURE else [(one.role, 1.0)]
        units = (
            [(one.unit, one.unit_chance), *one.unit_rivals] if one.unit_chance < SURE else [(one.unit, 1.0)]
        )
        pairs = [(role, one.unit) for role, _ in roles[:_MOST]] + [
            (one.role, unit) for unit, _ in units[1:_MOST]
        ]
        known = [pair for pair in dict.fromkeys(pairs) if _fits(*pair)]
        answers = tuple((f"{role}, {unit}", role, unit) for role, unit in known)
        if len(answers) > 1:
            found.append(Question(column.name, f"What is '{column.header}'? ({one.why})", answers))
    return found


def answered(guesses: Mapping[str, Guess], asked: Sequence[Question], ask: Ask) -> dict[str, Guess]:
    """The guesses with what a person says."""
    found = dict(guesses)
    for question in asked:
        _, role, unit = question.answers[ask(question)]
        found[question.about] = replace(
            found[question.about], role=role, unit=unit, said=True, why="you said so"
        )
    return found


def doubt(one: Guess) -> str | None:
    """What stands in the campaign file of a guess that nobody has confirmed."""
    if one.sure:
        return None
    parts = []
    if one.chance < SURE:
        others = ", ".join(f"{role} {p:.0%}" for role, p in one.rivals[:2])
        parts.append(f"role {one.chance:.0%}" + (f" (or {others})" if others else ""))
    if one.unit_chance < SURE:
        others = ", ".join(f"{unit} {p:.0%}" for unit, p in one.unit_rivals[:2])
        parts.append(f"unit {one.unit_chance:.0%}" + (f" (or {others})" if others else ""))
    return f"{'; '.join(parts)}: {one.why}"


def read_statements(given: Sequence[str]) -> tuple[dict[str, tuple[str | None, str | None]], str | None]:
    """What `--is NAME=ROLE,UNIT` says, by column; the unit of the clock of `--is time=min`.

    Raises:
        UsageError: no known role or unit.
    """
    found: dict[str, tuple[str | None, str | None]] = {}
    clock = None
    for text in given:
        name, mark, rest = text.rpartition("=")
        if not mark or not name.strip():
            raise UsageError(f'--is "{text}": say NAME=ROLE, NAME=UNIT or NAME=ROLE,UNIT')
        name = name.strip()
        if name.casefold() == "time":
            clock = time_unit(rest)
            if clock is None:
                raise UsageError(f'--is "{text}": allowed are {", ".join(TIME_UNITS)}')
            continue
        parts = [part.strip() for part in rest.split(",", 1)]
        role = parts[0] if parts[0] in ROLES else None
        unit = parts[1] if len(parts) > 1 else None if role else parts[0]
        if role is None and len(parts) > 1:
            raise UsageError(f'--is "{text}": no such role; {suggest(parts[0], list(ROLES))}')
        if unit is not None:
            spelled, listed = unit_of(unit)
            unit = listed or spelled
            if listed is None and not _fits(role or "other input", unit):
                what = f"no unit of a {role}" if role else "neither a role nor a unit"
                raise UsageError(f'--is "{text}": {what}; {_meant(parts[0], role)}')
        found[name] = (role, unit or None)
    return found, clock


def with_statements(
    columns: Sequence[Column],
    guesses: Mapping[str, Guess],
    said: Mapping[str, tuple[str | None, str | None]],
    room: str | None = None,
) -> dict[str, Guess]:
    """The guesses with what a person said on the command line.

    Raises:
        UsageError: no such column, or a unit that the role cannot have.
    """
    found = dict(guesses)
    known = {word: c.name for c in columns for word in (c.header, c.name)}
    wanted = {**said, **({room: ("ambient temperature", None)} if room else {})}
    for name, (role, unit) in wanted.items():
        if name not in known:
            raise UsageError(f"there is no column '{name}'; {suggest(name, [c.header for c in columns])}")
        one = found[known[name]]
        role = role or one.role
        unit = unit or (one.unit if _fits(role, one.unit) else _usual(role))
        if not _fits(role, unit):
            raise UsageError(f"'{name}': the unit {unit} cannot be that of a {role}")
        below = one.below_zero if role == "heat load" else 0.0
        found[known[name]] = replace(
            one, role=role, unit=unit, said=True, why="you said so", below_zero=below
        )
    return found


def _usual(role: str) -> str:
    return (*ROLES[role].units, "1")[0]


def _meant(word: str, role: str | None) -> str:
    """What may have been meant: a role, or a unit of one that is known."""
    if role is None:
        return suggest(word, list(ROLES))
    return f"a {role} is in {', '.join(ROLES[role].units)}, or in a unit of that dimension"


def _fits(role: str, unit: str) -> bool:
    try:
        conversion(unit, role)
    except UnitError:
        return False
    return True
