"""The files that `discovery new` writes, as text."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from discovery.files import format_toml
from discovery.firsthour.guess import Guess
from discovery.firsthour.room import Room
from discovery.firsthour.table import OwnTable
from discovery.firsthour.words import DEGREES


def csv_text(table: OwnTable) -> str:
    """A recording as the workbench reads it: seconds since its first row, an empty cell: not measured."""
    text = io.StringIO()
    text.write(",".join(["time", *(column.name for column in table.columns)]) + "\n")
    for index, stamp in enumerate(table.time - table.time[0]):
        cells = [column.values[index] for column in table.columns]
        text.write(",".join([f"{stamp:.10g}", *("" if np.isnan(v) else f"{v:.10g}" for v in cells)]) + "\n")
    return text.getvalue()


def campaign_text(
    folder: Path, guesses: Mapping[str, Guess], recordings: Mapping[str, OwnTable], room: Room | None
) -> str:
    """Text of ``campaign.toml``, with a remark where a person should look."""
    channels: dict[str, dict[str, object]] = {
        name: {"role": one.role, "unit": one.unit} for name, one in guesses.items()
    }
    for name, guessed in guesses.items():
        if guessed.corrects:
            channels[name]["corrects"] = guessed.corrects
        if guessed.role == "other input" and guessed.unit in DEGREES:
            channels[name]["between"] = "linear"
    remarks = {name: one.why for name, one in guesses.items() if not one.sure}
    given: dict[str, object] = {}
    if room is not None:
        # a room that nobody measured is known within its spread; taken as exact, it passes for physics
        channels["T_env"] = {"role": "ambient temperature", "unit": "degC", "spread": room.spread}
        given, remarks["T_env"] = {"set": {"T_env": room.degrees}}, room.why
    entries = {
        name: {"file": f"{name}.csv", **given, "note": f"from {table.path.name}"}
        for name, table in recordings.items()
    }
    text = format_toml({"name": folder.resolve().name, "channels": channels, "recordings": entries})
    head = "# Written by `discovery new`. Look at each role and unit: `discovery list roles` explains them.\n"
    lines = text.splitlines()
    for index, line in enumerate(lines):
        name = line.split(" ")[0]
        if name in remarks and "role =" in line:
            lines[index] = f"{line}  # guessed: {remarks[name]}"
    return head + "\n".join(lines) + "\n"


def experiment_text(folder: Path, names: Sequence[str], outputs: Sequence[str]) -> str:
    """Text of ``experiment.toml``: the last recording is held out."""

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
pysindy     = {{ kind = "pysindy" }}       # PySINDy as its users take it
regression  = {{ kind = "regression" }}    # ridge on the inputs as they are

[mismatch]
model = "first_order"
"""
