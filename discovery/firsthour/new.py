"""`discovery new`: campaign, model and experiment from an engineer's own CSV."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from discovery.errors import UserError
from discovery.files import format_toml, write_atomic
from discovery.firsthour.firstmodel import first_model
from discovery.firsthour.guess import Guess, drives, guess_all
from discovery.firsthour.table import Array, OwnTable, read_own

_LAST_THIRD = 2 / 3
_ROOM = 21.0  # degC, where nothing hints at it


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
    tables = _alike([read_own(Path(source)) for source in sources])
    guesses = guess_all(tables[0].columns)
    recordings = _recordings(tables)
    room, why_room = _room(tables, guesses)
    write = {f"{name}.csv": _csv(table, rows) for name, (table, rows) in recordings.items()}
    outputs = [name for name in _outputs(guesses) if not _never_moves(tables, name)] or _outputs(guesses)
    lines = _said(tables, guesses, recordings, why_room, room)
    if not outputs:
        raise UserError(
            f"{sources[0]}: no column looks like a measured temperature or error; "
            "call it e.g. T_table [degC] or E_Y0C [um]"
        )
    write["campaign.toml"] = _campaign(folder, guesses, recordings, room)
    write["model.toml"] = first_model(guesses, outputs, has_room=room is not None)
    write["experiment.toml"] = _experiment(folder, list(recordings), outputs)
    for name, content in write.items():
        write_atomic(folder / name, content)
    return [*lines, "", *_next(folder)]


def _alike(tables: Sequence[OwnTable]) -> list[OwnTable]:
    """The tables with the columns that all have, without inputs of unknown role that never move."""
    first = {column.name for column in tables[0].columns}
    for table in tables[1:]:
        here = {column.name for column in table.columns}
        if not first & here:
            raise UserError(
                f"{table.path}: its columns differ from those of {tables[0].path} "
                f"({', '.join(sorted(first ^ here))}); recordings of one campaign have the same columns"
            )
    common = first.intersection(*({column.name for column in table.columns} for table in tables))
    still = {
        name
        for name, one in guess_all(tables[0].columns).items()
        if name in common and one.role == "other input" and _never_moves(tables, name)
    }
    return [_kept(table, common, still) for table in tables]


def _never_moves(tables: Sequence[OwnTable], name: str) -> bool:
    values = np.concatenate(_columns(tables, name))
    return not bool(np.nanmin(values) < np.nanmax(values))


def _kept(table: OwnTable, common: set[str], still: set[str]) -> OwnTable:
    notes = list(table.notes)
    for column in table.columns:
        if column.name not in common:
            notes.append(f"column '{column.header}' is not in every file: left out")
        elif column.name in still:
            notes.append(f"column '{column.header}' never moves: left out")
    kept = tuple(c for c in table.columns if c.name in common - still)
    if not kept:
        raise UserError(f"{table.path}: no column but time holds values that move")
    return replace(table, columns=kept, notes=tuple(notes))


def _recordings(tables: Sequence[OwnTable]) -> dict[str, tuple[OwnTable, slice]]:
    if len(tables) == 1:
        split = round(_LAST_THIRD * len(tables[0].time))
        return {"first_part": (tables[0], slice(0, split)), "last_part": (tables[0], slice(split, None))}
    found: dict[str, tuple[OwnTable, slice]] = {}
    for table in tables:
        stem = re.sub(
            r"[^\w.+-]+", "_", table.path.name.removesuffix(".gz").rsplit(".", 1)[0], flags=re.ASCII
        ).strip("_.")
        name, count = stem or "recording", 1
        while name in found:
            count += 1
            name = f"{stem}_{count}"
        found[name] = (table, slice(None))
    return found


def _outputs(guesses: Mapping[str, Guess]) -> list[str]:
    errors = [name for name, one in guesses.items() if one.role == "error"]
    return errors or [name for name, one in guesses.items() if one.role == "temperature"]


def _room(tables: Sequence[OwnTable], guesses: Mapping[str, Guess]) -> tuple[float | None, str]:
    """A constant room temperature [degC] where none was recorded, and where it comes from."""
    if any(one.role == "ambient temperature" for one in guesses.values()):
        return None, ""
    from discovery.recordings.units import conversion

    lowest = []
    for column in tables[0].columns:
        one = guesses[column.name]
        if one.role == "temperature":
            rule = conversion(one.unit, one.role)
            coolest = min(_coolest(values) for values in _columns(tables, column.name))
            lowest.append(coolest * rule.factor + rule.offset)
    if not lowest:
        return _ROOM, "no ambient temperature is recorded: a room is taken"
    return round(min(lowest), 1), "no ambient temperature: the coolest readings are taken as the room"


def _coolest(values: Array) -> float:
    """The lowest median of five readings in a row: an outlier is no room."""
    known = values[np.isfinite(values)]
    if len(known) < 5:
        return float(known.min()) if len(known) else math.inf
    return float(np.median(np.lib.stride_tricks.sliding_window_view(known, 5), axis=1).min())


def _columns(tables: Sequence[OwnTable], name: str) -> list[Array]:
    return [c.values for table in tables for c in table.columns if c.name == name]


def _csv(table: OwnTable, rows: slice) -> str:
    text = io.StringIO()
    text.write(",".join(["time", *(column.name for column in table.columns)]) + "\n")
    time = table.time[rows]
    for index, stamp in enumerate(time - time[0]):
        cells = [column.values[rows][index] for column in table.columns]
        text.write(",".join([f"{stamp:.10g}", *("" if np.isnan(v) else f"{v:.10g}" for v in cells)]) + "\n")
    return text.getvalue()


def _campaign(
    folder: Path,
    guesses: Mapping[str, Guess],
    recordings: Mapping[str, tuple[OwnTable, slice]],
    room: float | None,
) -> str:
    channels: dict[str, dict[str, object]] = {
        name: {"role": one.role, "unit": one.unit} for name, one in guesses.items()
    }
    for name, guessed in guesses.items():
        if guessed.corrects:
            channels[name]["corrects"] = guessed.corrects
        if guessed.role == "other input" and guessed.unit in ("degC", "K"):
            channels[name]["between"] = "linear"
    if room is not None:
        # a room that nobody measured is known within a kelvin; taken as exact, it passes for physics
        channels["T_env"] = {"role": "ambient temperature", "unit": "degC", "spread": 1.0}
    given = {"set": {"T_env": room}} if room is not None else {}
    entries = {
        name: {"file": f"{name}.csv", **given, "note": f"from {table.path.name}"}
        for name, (table, _) in recordings.items()
    }
    text = format_toml({"name": folder.resolve().name, "channels": channels, "recordings": entries})
    head = "# Written by `discovery new`. Look at each role and unit: `discovery list roles` explains them.\n"
    lines = text.splitlines()
    for index, line in enumerate(lines):
        one = guesses.get(line.split(" ")[0])
        if one and not one.sure and "role =" in line:
            lines[index] = f"{line}  # guessed: {one.why}"
    return head + "\n".join(lines) + "\n"


def _experiment(folder: Path, names: Sequence[str], outputs: Sequence[str]) -> str:
    def listed(words: Sequence[str]) -> str:
        return ", ".join(f'"{word}"' for word in words)

    name = re.sub(r"[^\w .+-]+", "_", folder.resolve().name)
    return f"""# Written by `discovery new`. Fits see the recordings under fit alone.
name = "{name}"
campaign = "campaign.toml"
outputs  = [{listed(outputs)}]
fit      = [{listed(names[:-1])}]
held_out = [{listed(names[-1:])}]

[models]
first_order = {{ file = "model.toml" }}
discovered  = {{ kind = "sindy" }}

[mismatch]
model = "first_order"
"""


def _said(
    tables: Sequence[OwnTable],
    guesses: Mapping[str, Guess],
    recordings: Mapping[str, tuple[OwnTable, slice]],
    why_room: str,
    room: float | None,
) -> list[str]:
    width = max(len(column.header) for column in tables[0].columns)
    inner = max(len(f"{c.name}: {guesses[c.name].role}, {guesses[c.name].unit}") for c in tables[0].columns)
    lines = []
    for table in tables:
        lines.append(
            f"{table.path.name}: {len(table.time)} rows over {_duration(float(table.time[-1]))}; "
            f"time {table.about_time}"
        )
        lines += [f"  {note}" for note in table.notes]
    lines.append("guessed (? = have a look):")
    for column in tables[0].columns:
        one = guesses[column.name]
        what = f"{column.name}: {one.role}, {one.unit}"
        lines.append(f"  {column.header:{width}} -> {what:{inner}} {' ' if one.sure else '?'} {one.why}")
    if room is not None:
        lines.append(f"  {'':{width}} -> T_env: {why_room} ({room:g} degC, known within 1 K)")
    warmed = [n for n, one in guesses.items() if one.role == "other input" and one.unit in ("degC", "K")]
    if not drives(guesses) and not warmed:
        lines.append(
            "no column says what heats the machine: a model can only follow its surroundings; "
            "record a power, current, speed or switch as well"
        )
    names = list(recordings)
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
