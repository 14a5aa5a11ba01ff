"""Files as recordings of one machine: which of them are seen, and which of their columns say something."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discovery.errors import UserError
from discovery.firsthour.clocks import bookkeeping, counts_up, tells_time
from discovery.firsthour.evidence import OTHER, is_set_point_word
from discovery.firsthour.filenames import constants, file_hints
from discovery.firsthour.guess import SURE, TEMPERATURES, Guess, guess
from discovery.firsthour.measures import DEGREES, TIME_UNITS, known_unit
from discovery.firsthour.odds import probabilities
from discovery.firsthour.stamps import stated_interval
from discovery.firsthour.table import Array, Column, OwnTable, ascii_of
from discovery.firsthour.tableguess import guess_all
from discovery.firsthour.vocabulary import SET_POINT, words_of
from discovery.recordings.timeunit import time_odds
from discovery.recordings.units import UnitError, conversion

_LAST_THIRD = 2 / 3
_ELSEWHERE = 30.0  # times what a column moves in a run
_ALONE = 2.0  # times as far as in any other recording: the last one alone moves a channel
_ANSWERS = ("error", "other output", "temperature")
_ELECTRIC = ("current", "voltage")
_OWN = "time"  # the name that the documents give to a column of seconds
_KEPT_TO = 2.0  # log odds that who uses this name keeps to its unit, too


@dataclass(frozen=True)
class Recorded:
    """`recordings`: the last one is unseen, that of the files or the one before (`_most_moving_first`).

    `seen`: each column, its values joined from all others. `guesses`: of each column. `clock`: probabilities
    of the units in which an undecided clock counts, the likeliest first. `constants`: what the names of the
    files say, by channel: unit, and value by recording. `notes`: what was left out.
    """

    recordings: dict[str, OwnTable]
    seen: tuple[Column, ...]
    guesses: dict[str, Guess]
    clock: dict[str, float]
    constants: dict[str, tuple[str, dict[str, float]]]
    notes: tuple[str, ...]


def recorded(
    tables: Sequence[OwnTable], time_unit: str | None = None, wanted: Collection[str] = ()
) -> Recorded:
    """Recordings with the columns that all have and that say something in what is seen.

    Whatever is chosen or guessed is so from `seen` alone: what the unseen recording holds stays a question.

    Args:
        time_unit: what a person says of a clock whose unit nothing names.
        wanted: headers or names of columns of which a person says something: they stay.

    Raises:
        UserError: files that have nothing in common, or of which nothing is left.
    """
    recordings = _same_units(_recordings(tables))
    recordings, clock, notes = _counted(recordings, time_unit)
    common, left = _common(list(recordings.values()))
    notes += left
    if len(tables) > 1:
        recordings = _most_moving_first(recordings, common)
    names, runs = list(recordings), list(recordings.values())
    seen = [_joined(column, runs[:-1]) for column in runs[0].columns if column.name in common]
    hints = file_hints({name: recordings[name] for name in names[:-1]})
    guesses = guess_all(seen, hints)
    moves = any(one.role in ("heat load", "rotation speed") for one in guesses.values())
    kept = []
    for column in seen:
        of_runs = [(run.time, values) for run in runs[:-1] for values in _values(run, column.name)]
        why = _says_nothing(column, guesses[column.name], of_runs, has_load=moves)
        if why and not {column.header, column.name} & set(wanted):
            notes.append(f"column '{column.header}' {why}")
        else:
            kept.append(column)
    if not kept:
        raise UserError(
            f"{tables[0].path}: no column except time has values that change; record a temperature or "
            "an error" + (f" ({'; '.join(notes)})" if notes else "")
        )
    guesses = {
        column.name: replace(one, role="other input", why=f"{one.why}, set by a controller")
        if is_set_point_word(column.header) and (one := guesses[column.name]).role in TEMPERATURES
        else guesses[column.name]
        for column in kept
    }
    guesses = _renewed(kept, hints, guesses)
    fixed = constants([_stem(runs[k]) for k in range(len(runs))], [one.quantity for one in guesses.values()])
    by_stem = {_stem(run): name for name, run in recordings.items()}
    return Recorded(
        {name: replace(run, columns=_of(run, [c.name for c in kept])) for name, run in recordings.items()},
        tuple(kept),
        guesses,
        clock,
        {
            quantity: (unit, {by_stem[stem]: value for stem, value in values.items()})
            for quantity, (unit, values) in fixed.items()
        },
        tuple(dict.fromkeys(notes)),
    )


def _most_moving_first(recordings: dict[str, OwnTable], common: Collection[str]) -> dict[str, OwnTable]:
    """The recordings with the last one in front where it alone moves what is measured: nothing that is fitted
    to the others could predict it. The one before is unseen then.
    """
    runs = list(recordings.values())
    every = [_joined(column, runs) for column in runs[0].columns if column.name in common]
    asked = [name for name, one in guess_all(every).items() if one.role in _ANSWERS]
    spans = np.array([[max(map(_span, _values(run, name)), default=0.0) for name in asked] for run in runs])
    moves = spans[-1] > 0
    if not moves.any() or np.any(_ALONE * spans[:-1, moves].max(axis=0) >= spans[-1, moves]):
        return recordings
    *others, last = recordings
    return {name: recordings[name] for name in (last, *others)}


def _span(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def never_moves(column: Column) -> bool:
    """Whether all readings are alike, or none is there."""
    return len(np.unique(column.values[np.isfinite(column.values)])) < 2


def _renewed(
    kept: Sequence[Column],
    hints: Mapping[str, Sequence[tuple[str, Mapping[str, float]]]],
    guesses: Mapping[str, Guess],
) -> dict[str, Guess]:
    """Guesses again from the columns that were kept: a column that was left out says nothing of
    them.
    """
    again = guess_all(kept, hints)
    return {
        name: one if one.role == "other input" and one.why.endswith("controller") else again[name]
        for name, one in guesses.items()
    }


def _stem(run: OwnTable) -> str:
    return run.path.name.removesuffix(".gz").rsplit(".", 1)[0] + (f" {run.name}" if run.name else "")


def _recordings(tables: Sequence[OwnTable]) -> dict[str, OwnTable]:
    if len(tables) == 1:
        split = round(_LAST_THIRD * len(tables[0].time))
        return {"first_part": _cut(tables[0], slice(split)), "last_part": _cut(tables[0], slice(split, None))}
    found: dict[str, OwnTable] = {}
    for table in tables:
        stem = re.sub(r"[^\w.+-]+", "_", ascii_of(_stem(table))).strip("_.")
        stem = name = stem or "recording"
        count = 1
        while name in found:
            count += 1
            name = f"{stem}_{count}"
        found[name] = table
    return found


def _cut(table: OwnTable, rows: slice) -> OwnTable:
    columns = tuple(replace(column, values=column.values[rows]) for column in table.columns)
    return replace(table, time=table.time[rows], columns=columns)


def _same_units(recordings: dict[str, OwnTable]) -> dict[str, OwnTable]:
    """Every column in the unit of the first recording, where another logger was set to Fahrenheit or
    inches.
    """
    first = {c.name: c.unit for c in next(iter(recordings.values())).columns}
    return {
        name: replace(run, columns=tuple(_in_unit(c, first.get(c.name, "")) for c in run.columns))
        for name, run in recordings.items()
    }


def _in_unit(column: Column, unit: str) -> Column:
    here, wanted = known_unit(column.unit), known_unit(unit)
    if not unit or here is None or wanted is None or here == wanted:
        return replace(column, unit=column.unit or unit)
    role = (
        "temperature"
        if here in DEGREES
        else "error"
        if wanted in ("um", "mm", "inch", "thou")
        else "heat load"
    )
    try:
        a, b = conversion(here, role), conversion(wanted, role)
    except UnitError:
        return column
    return replace(column, unit=unit, values=(a.factor * column.values + a.offset - b.offset) / b.factor)


def _counted(
    recordings: dict[str, OwnTable], said: str | None
) -> tuple[dict[str, OwnTable], dict[str, float], list[str]]:
    """Undecided clocks in seconds: one unit for all of them, by what the seen recordings say together."""
    undecided = [name for name, run in recordings.items() if run.counted]
    if not undecided:
        return recordings, {}, []
    seen = [run for name, run in list(recordings.items())[:-1] if run.counted] or [recordings[undecided[0]]]
    thermal = _thermal(guess_all(seen[0].columns).values())
    odds: dict[str, float] = {}
    for run in seen:
        for unit, value in time_odds(
            run.time, [c.values for c in run.columns], stated_interval(run.above), thermal=thermal
        ).items():
            # recordings of one logger say the same again: their mean counts, not their sum
            odds[unit] = odds.get(unit, 0.0) + value / len(seen)
    if all(run.clock == _OWN for run in seen):
        odds["s"] += _KEPT_TO
    shares = {said: 1.0} if said else probabilities(odds)
    unit, chance = next(iter(shares.items()))
    doubt = "" if chance >= 0.9 else f" (? {chance:.0%} likely; nothing names its unit)"
    scaled = {
        name: replace(
            run,
            time=run.time * TIME_UNITS[unit],
            about_time=f"{run.about_time.replace('counted', f'counted in {unit}{doubt}')}",
        )
        if run.counted
        else run
        for name, run in recordings.items()
    }
    return scaled, shares, []


def _thermal(guesses: Iterable[Guess]) -> float:
    """Probability that at least one column is a temperature or a thermal error."""
    none = 1.0
    for one in guesses:
        roles = {one.role: one.chance, **dict(one.rivals)}
        none *= 1.0 - min(1.0, sum(roles.get(role, 0.0) for role in (*TEMPERATURES, "error")))
    return 1.0 - none


def _common(runs: Sequence[OwnTable]) -> tuple[set[str], list[str]]:
    """Return the names that all recordings have, and a note about the others."""
    first = {column.name for column in runs[0].columns}
    for table in runs[1:]:
        here = {column.name for column in table.columns}
        if not first & here:
            raise UserError(
                f"{table.path}: its columns differ from those of {runs[0].path} "
                f"({', '.join(sorted(first ^ here))}); recordings of one campaign have the same "
                "columns. Is it "
                "the other logger of the same hours? Then say --join instead of --from"
            )
    common = first.intersection(*({column.name for column in run.columns} for run in runs))
    others = [column.header for run in runs for column in run.columns if column.name not in common]
    return common, [f"column '{header}' is not in every file: left out" for header in others]


def _says_nothing(
    column: Column, one: Guess, of_runs: Sequence[tuple[Array, Array]], *, has_load: bool
) -> str:
    """Why a column is left out, or ""."""
    role = _named(column)
    if all(tells_time(column.header, column.unit, values, time, role) for time, values in of_runs):
        return "is a clock, in exact proportion to the time: left out (if not, name its unit in the header)"
    electric = any(word.gloss in _ELECTRIC for word in words_of(column.header)) and not counts_up(
        column.header
    )
    unit = column.unit or ("V" if electric else "")  # a ramp of a voltage is no clock
    books = [bookkeeping(column.header, unit, values, time, role) for time, values in of_runs]
    if all(books):
        return f"{books[0]}: left out" + ("" if column.unit else " (if not, name its unit in the header)")
    bare = all(word.gloss == SET_POINT for word in words_of(column.header)) and not column.unit
    if is_set_point_word(column.header) and (one.role in TEMPERATURES or bare):
        if never_moves(column):
            return "is a set point that never moves: left out"
        if has_load:
            return "is a set point, no measurement: left out"
    if not np.isfinite(column.values).any():
        return "has no values in the recordings to fit: left out"
    inputs = one.role == "other input" or (
        one.role not in TEMPERATURES and one.role != "error" and not one.sure
    )
    if not (inputs and never_moves(column)):
        return ""
    role = one.role if one.chance >= SURE else OTHER  # a guess is no advice
    return f'never moves in the recordings to fit: left out (to keep it: --is "{column.header}={role}")'


def _named(column: Column) -> str:
    """Return the role that name and unit state, without a look at the values."""
    return guess(replace(column, values=np.zeros(0))).role


def _joined(column: Column, runs: Sequence[OwnTable]) -> Column:
    """The column of all runs, end to end. What starts elsewhere in each run, far beyond what it moves, has an
    arbitrary zero: its runs are joined at their first readings, so that its span is that of a run.
    """
    values = [v for run in runs for v in _values(run, column.name)]
    known = [one for v in values if (one := v[np.isfinite(v)]).size]
    spans, firsts = [np.ptp(one) for one in known], [one[0] for one in known]
    if known and np.ptp(firsts) > _ELSEWHERE * max(spans) > 0.0:
        values = [v - v[np.isfinite(v)][:1].sum() + firsts[0] for v in values]
    return replace(column, values=np.concatenate(values))


def _values(run: OwnTable, name: str) -> list[Array]:
    return [column.values for column in run.columns if column.name == name]


def _of(run: OwnTable, names: Sequence[str]) -> tuple[Column, ...]:
    by_name = {column.name: column for column in run.columns}
    return tuple(by_name[name] for name in names)
