"""Files written again: one that nobody changed is replaced, one that a person changed is kept."""

from __future__ import annotations

import hashlib
from pathlib import Path

import tomlkit

from discovery.experiment.form import ExperimentForm
from discovery.files import read_text, read_toml, write_atomic
from discovery.firsthour.plan import Plan

_SEAL = "# Unchanged: "  # and a hash of the rest: nobody has edited the file since


def sealed(text: str) -> str:
    """A text with a first line that shows later whether somebody changed it."""
    return f"{_SEAL}{_hash(text)}\n{text}"


def is_untouched(path: Path) -> bool:
    """Whether a file is as `discovery new` wrote it, or is not there."""
    if not path.exists():
        return True
    head, _, rest = read_text(path).partition("\n")
    return head.startswith(_SEAL) and head.removeprefix(_SEAL) == _hash(rest)


def touched(folder: Path) -> ExperimentForm | None:
    """The experiment of a folder, where a person changed it."""
    path = folder / "experiment.toml"
    return None if is_untouched(path) else read_toml(path, ExperimentForm)


def rewrite(folder: Path, made: Plan) -> list[str]:
    """Write models and experiment of a plan; lines about what was kept.

    A model that a person changed stays; the new one gets a file of its own. In an experiment that a person
    changed, the models of the plan are renewed and names that are no longer outputs are removed; the rest,
    remarks included, does not change.
    """
    notes = []
    models = dict(made.models)
    for name, text in made.files.items():
        path = folder / name
        if name == "experiment.toml":
            continue
        if not is_untouched(path):
            other = f"new_{name}"
            notes.append(f"{path}: you changed it, so it stays; the new one is {other}")
            models = {key: entry.replace(f'"{name}"', f'"{other}"') for key, entry in models.items()}
            path = folder / other
        write_atomic(path, sealed(text))
    experiment = folder / "experiment.toml"
    text = made.files["experiment.toml"]
    if is_untouched(experiment):
        for key, entry in made.models.items():
            text = text.replace(entry, models[key])
        write_atomic(experiment, sealed(text))
        return notes
    write_atomic(experiment, _merged(read_text(experiment), text, models, made.mismatch))
    notes.append(f"{experiment}: you changed it, so only the models that were made anew are renewed in it")
    return notes


def _merged(before: str, now: str, models: dict[str, str], mismatch: str | None) -> str:
    old, new = tomlkit.parse(before), tomlkit.parse(now)
    old["outputs"] = new["outputs"]
    table = old["models"]
    for key, entry in models.items():
        table[key] = tomlkit.parse(f"x = {entry}")["x"]
    if "mismatch" in old and old["mismatch"]["model"] not in table and mismatch:
        old["mismatch"]["model"] = mismatch
    return tomlkit.dumps(old)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
