"""`discovery new`: campaign, model and experiment from an engineer's own CSV."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.files import write_atomic
from discovery.firsthour.firstmodel import first_model
from discovery.firsthour.guess import Guess, drives, guess_all
from discovery.firsthour.recorded import Recorded, never_moves, recorded
from discovery.firsthour.room import Room, guess_room
from discovery.firsthour.table import Column, OwnTable, read_own
from discovery.firsthour.texts import campaign_text, csv_text, experiment_text
from discovery.firsthour.words import DEGREES


def new(folder: Path, sources: Sequence[Path]) -> list[str]:
    """Write recordings, ``campaign.toml``, ``model.toml`` and ``experiment.toml`` into a folder.

    Several files are recordings of one machine, the last one kept unseen; of a single file the last third is.

    Returns:
        Lines that say what was guessed, why, and what comes next.

    Raises:
        UserError: the folder has a campaign already, or a file cannot be read.
    """
    if (folder / "campaign.toml").exists():
        raise UserError(f"{folder}: campaign.toml is there already; name another folder, or delete it first")
    tables = [read_own(Path(source)) for source in sources]
    found = recorded(tables)
    guesses = guess_all(found.seen)
    room = guess_room(found.seen, guesses)
    outputs = _outputs(found.seen, guesses)
    if not outputs:
        raise UserError(
            f"{sources[0]}: no column looks like a measured temperature or error; "
            "call it e.g. T_table [degC] or E_Y0C [um]"
        )
    write = {f"{name}.csv": csv_text(table) for name, table in found.recordings.items()}
    write["campaign.toml"] = campaign_text(folder, guesses, found.recordings, room)
    write["model.toml"] = first_model(guesses, outputs, has_room=room is not None)
    write["experiment.toml"] = experiment_text(folder, list(found.recordings), outputs)
    for name, content in write.items():
        write_atomic(folder / name, content)
    return [*_said(tables, found, guesses, room), "", *_next(folder)]


def _outputs(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> list[str]:
    """The errors, else the temperatures; without those that never move, if any moves."""
    errors = [column for column in columns if guesses[column.name].role == "error"]
    found = errors or [column for column in columns if guesses[column.name].role == "temperature"]
    return [column.name for column in found if not never_moves(column)] or [column.name for column in found]


def _said(
    tables: Sequence[OwnTable], found: Recorded, guesses: Mapping[str, Guess], room: Room | None
) -> list[str]:
    lines = []
    for table in tables:
        lines.append(
            f"{table.path.name}: {len(table.time)} rows over "
            f"{_duration(float(table.time[-1]))}; time {table.about_time}"
        )
        lines += [f"  {note}" for note in table.notes]
    lines += found.notes
    lines.append("guessed (? = have a look):")
    rows = [
        (c.header, f"{c.name}: {one.role}, {one.unit}", "" if one.sure else "?", one.why)
        for c in found.seen
        for one in [guesses[c.name]]
    ]
    if room is not None:
        known = f"{room.degrees:g} degC, known within {room.spread:g} K"
        rows.append(("", "T_env: ambient temperature, degC", "?", f"{room.why} ({known})"))
    width, inner = (max(len(row[place]) for row in rows) for place in (0, 1))
    lines += [f"  {header:{width}} -> {what:{inner}} {mark:1} {why}" for header, what, mark, why in rows]
    warmed = [n for n, one in guesses.items() if one.role == "other input" and one.unit in DEGREES]
    if not drives(guesses) and not warmed:
        lines.append(
            "no column says what heats the machine: a model can only follow its surroundings; "
            "record a power, current, speed or switch as well"
        )
    lines += [
        f"'{name}' is below zero in {one.below_zero:.0%} of its readings, so its gain may have either sign; "
        "a heat load below zero cools: where it is heat (a discharge, a brake), write its magnitude"
        for name, one in guesses.items()
        if one.below_zero
    ]
    names = list(found.recordings)
    lines.append(f"recordings: fit {', '.join(names[:-1])}; unseen {names[-1]}")
    return lines


def _duration(seconds: float) -> str:
    return (
        f"{seconds / 3600:.3g} h"
        if seconds >= 7200
        else f"{seconds / 60:.3g} min"
        if seconds >= 120
        else f"{seconds:.3g} s"
    )


def _next(folder: Path) -> list[str]:
    return [
        f"written to {folder}: campaign.toml, model.toml, experiment.toml. Next:",
        f"  discovery check {folder}",
        f"  discovery run {folder}/experiment.toml",
    ]
