"""The files that `discovery new` writes, as text."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence

from discovery.files import format_toml
from discovery.firsthour.asking import doubt
from discovery.firsthour.explain import FIRST_MODELS
from discovery.firsthour.guess import Guess
from discovery.firsthour.measures import DEGREES
from discovery.firsthour.recorded import Recorded
from discovery.firsthour.room import ROOM, Room
from discovery.firsthour.shapes import is_set
from discovery.firsthour.table import OwnTable

_CONSTANTS = {"speed": "rotation speed", "flow": "fluid flow", "power": "heat load"}


def csv_text(table: OwnTable) -> str:
    """A recording as the workbench reads it: seconds since its first row, an empty cell: not measured."""
    import pandas as pd

    frame = pd.DataFrame({"time": table.time - table.time[0], **{c.name: c.values for c in table.columns}})
    text = io.StringIO()
    frame.to_csv(text, index=False, float_format="%.10g", lineterminator="\n")
    return text.getvalue()


def campaign_text(
    title: str,
    found: Recorded,
    guesses: Mapping[str, Guess],
    room: Room | None,
    about_room: str,
    kept: Mapping[str, Mapping[str, object]],
    zeros: Mapping[str, float],
) -> str:
    """Text of ``campaign.toml``; what nobody has confirmed says so under `guessed`.

    Args:
        kept: channels as a person wrote them before.
        zeros: spread of each error with a zero of its own in each recording.
    """
    channels: dict[str, dict[str, object]] = {}
    headers = {column.name: column.header for column in found.seen}
    steps = {column.name for column in found.seen if is_set(column.values)}
    for name, one in guesses.items():
        entry: dict[str, object] = {"role": one.role, "unit": one.unit}
        if one.corrects:
            entry["corrects"] = one.corrects
        if one.role == "other input" and one.unit in DEGREES and name not in steps:
            entry["between"] = "linear"
        if question := doubt(one):
            entry["guessed"] = question
        channels[name] = dict(kept.get(name, entry))
        if name in zeros:
            channels[name].setdefault("spread", zeros[name])
    given: dict[str, dict[str, float]] = {name: {} for name in found.recordings}
    for quantity, (unit, values) in found.constants.items():
        channels[quantity] = {
            "role": _CONSTANTS[quantity],
            "unit": unit,
            "guessed": "from the names of the files",
        }
        for name, value in values.items():
            given[name][quantity] = value
    if room is not None:
        channels[ROOM] = {"role": "ambient temperature", "unit": "degC", "spread": room.spread}
        for name in given:
            given[name][ROOM] = room.degrees
    entries = {
        name: {
            "file": f"{name}.csv",
            **({"set": given[name]} if given[name] else {}),
            "note": f"from {table.path.name}",
        }
        for name, table in found.recordings.items()
    }
    clock = clock_doubt(found)
    text = format_toml(
        {
            "name": title,
            **({"guessed": clock} if clock else {}),
            "channels": channels,
            "recordings": entries,
        }
    )
    lines = text.splitlines()
    for index, line in enumerate(lines):
        header = headers.get(line.split(" ")[0])
        if header and "role =" in line and header != line.split(" ")[0]:
            lines[index] = f"{line}  # {header}"
    head = [
        "# Written by `discovery new`. Check each role and unit (`discovery list roles` explains them).",
        "# Delete `guessed = ...` where a guess is right. Roles corrected: `discovery new DIR --again`.",
        *(["# " + about_room.replace("\n", " ")] if about_room else []),
    ]
    return "\n".join([*head, *lines]) + "\n"


def clock_doubt(found: Recorded) -> str | None:
    """What stands in the campaign file of a clock whose unit nobody has confirmed."""
    (unit, chance), *others = (*found.clock.items(), ("", 1.0))
    if not unit or chance >= 0.9:
        return None
    rest = ", ".join(f"{other} {p:.0%}" for other, p in others if other and p > 0.02)
    return f"time counted in {unit}: {chance:.0%} (or {rest}); another one: new ... --is time={others[0][0]}"


def experiment_text(
    title: str,
    names: Sequence[str],
    outputs: Sequence[str],
    models: Mapping[str, str],
    mismatch: str | None,
    remarks: Sequence[str],
) -> str:
    """Text of ``experiment.toml``: the last recording is held out.

    Args:
        names: the last one is held out. models: lines of [models], by name.
        mismatch: the model to diagnose, if any.
        remarks: how the models were chosen.
    """

    def listed(words: Sequence[str]) -> str:
        return ", ".join(f'"{word}"' for word in words)

    name = re.sub(r"[^\w .+-]+", "_", title).lstrip(" .+-") or "experiment"
    width = max(map(len, models))
    lines = [f"{model:{width}} = {entry}" for model, entry in models.items()]
    meant = [f"# {model}: {FIRST_MODELS[model]}" for model in models if model in FIRST_MODELS]
    remarked = "\n".join(f"# {line}" for line in remarks)
    why = "# The diagnosis asks what this model lacks. It is the simplest one that predicts."
    diagnosed = f'\n{why}\n[mismatch]\nmodel = "{mismatch}"\n' if mismatch else ""
    return f"""# Written by `discovery new`. Fits use only the recordings under fit.
name = "{name}"
campaign = "campaign.toml"
outputs  = [{listed(outputs)}]
fit      = [{listed(names[:-1])}]
held_out = [{listed(names[-1:])}]

{remarked}
[models]
{chr(10).join([*meant, *lines])}
{diagnosed}"""
