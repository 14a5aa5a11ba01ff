"""A diagnosis in the folder of a run: the run's other models stay, next to what the diagnosis found.

What the diagnosis makes (diagnosis, diagnosed model, repaired model) replaces what has its name, and a
repaired model goes with the diagnosis it came from. The other models stay where they are models of the same
recordings; where not, one table could not hold both, and the diagnosis asks for a folder of its own.
"""

from __future__ import annotations

import csv
import io
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.experiment.experiment import Experiment
from discovery.experiment.inputfiles import hashes, recording_files
from discovery.experiment.results import write_json
from discovery.files import read_text, write_atomic
from discovery.runfolder import RESULTS, read_results


def check_joins(folder: Path, experiment: Experiment, diagnosed: str) -> None:
    """Can a diagnosis of the model `diagnosed` join the models in `folder`?

    Raises:
        UserError: other models stand there, of other recordings.
    """
    if not (folder / RESULTS).exists():
        return
    before = read_results(folder)
    others = _staying(before, [diagnosed])
    now = {
        "experiment": experiment.name,
        "fit": list(experiment.fit),
        "held_out": list(experiment.held_out),
        "outputs": list(experiment.outputs),
    }
    known = before.get("inputs", {})
    differs = [key for key, value in now.items() if before.get(key) != value]
    differs += [name for name, sha in hashes(recording_files(experiment)).items() if known.get(name) != sha]
    if others and differs:
        raise UserError(
            f"{folder}: holds other models ({', '.join(others)}), and {differs[0]} has changed since they "
            "were fitted; name another folder with --out, or make the run again first"
        )


def join(folder: Path, temporary: Path) -> None:
    """Put the models of `folder` that stay into the results of a diagnosis in `temporary`."""
    if not (folder / RESULTS).exists():
        return
    before, now = read_results(folder), read_results(temporary)
    staying = _staying(before, now["models"])
    if not staying:
        return
    models = {name: now["models"].get(name, entry) for name, entry in before["models"].items()}
    models = {name: entry for name, entry in models.items() if name in staying or name in now["models"]}
    then, command = str(before.get("command", "")), str(now["command"])
    joined = {
        "command": then if then.endswith(command) else f"{then} && {command}",
        "models": models | now["models"],
        "seconds": now["seconds"] + sum(before["models"][name].get("seconds", 0.0) for name in staying),
        "inputs": {**before["inputs"], **now["inputs"]},
    }
    write_json(temporary / RESULTS, now | joined)
    for name in staying:
        model = Path("models") / f"{name}.toml"
        if (folder / model).exists():
            shutil.copy2(folder / model, temporary / model)
    for path in (temporary / "predictions").glob("*.csv"):
        earlier = folder / "predictions" / path.name
        if earlier.exists():
            write_atomic(path, _beside(read_text(earlier), read_text(path), staying))


def _staying(before: Mapping[str, Any], made: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """Names of the models of a run that a diagnosis, which made some, leaves where they are."""
    entries = before["models"].items()
    return [name for name, entry in entries if name not in made and entry.get("kind") != "repaired"]


def _beside(earlier: str, now: str, staying: Sequence[str]) -> str:
    """Two tables of predictions as one, with the columns of the models that stay from the earlier one."""
    tables = [list(csv.DictReader(io.StringIO(text))) for text in (earlier, now)]
    old, new = (list(table[0]) if table else [] for table in tables)
    read = [name for name in (*new, *old) if "|" not in name]
    kept = [name for name in old if name.partition("|")[2] in staying]
    columns = list(dict.fromkeys([*read, *kept, *new]))
    rows: dict[str, dict[str, str]] = {}
    for table, names in zip(tables, ([*read, *kept], new), strict=True):
        for row in table:
            cells = {name: row[name] for name in names if row.get(name)}
            rows.setdefault(row["time"], {}).update(cells)
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows[time] for time in sorted(rows, key=float))
    return text.getvalue()
