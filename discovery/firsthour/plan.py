"""From a campaign to its first models and experiment: chosen by what each predicts that its fit did not
see.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from discovery.experiment import load_experiment
from discovery.files import read_toml, write_atomic
from discovery.firsthour.choosing import CANDIDATES, NOT_TRIED, Score, choose
from discovery.firsthour.explain import FIRST_MODELS
from discovery.firsthour.firstmodel import first_model, usual_inputs
from discovery.firsthour.guess import FLUIDS, SUN, Guess, drives, is_irradiance
from discovery.firsthour.inputs import strongest
from discovery.firsthour.texts import experiment_text
from discovery.firsthour.vocabulary import words_of
from discovery.progress import Progress, silent
from discovery.recordings import Campaign, load_campaign
from discovery.recordings.campaignfile import CampaignForm, ChannelForm
from discovery.recordings.columns import FEW
from discovery.recordings.valuecheck import below_zero

REFERENCES = ("discovered", "regression", "pysindy")  # every experiment compares with them
HAND_BUILT = {"first_order": ("model.toml", 1), "two_masses": ("two_masses.toml", 2)}
_QUIET = 3.0  # times its noise: an output that moves less says nothing


@dataclass(frozen=True)
class Plan:
    """`files`: name -> text of models and experiment. `scores`: best first. `said`: lines for a person."""

    files: dict[str, str]
    scores: tuple[Score, ...]
    said: tuple[str, ...]
    models: dict[str, str]
    mismatch: str | None


def plan(
    folder: Path, title: str, names: Sequence[str], progress: Progress = silent, *, quick: bool = False
) -> Plan:
    """First models and the experiment of the campaign in a folder; the last of the named recordings is
    unseen.

    Args:
        folder: holds campaign.toml and the recordings; trial models are written into it. title: of the
        experiment. names: recordings, the last one held out.
        quick: models are not compared: a simple one and a discovered one are written.

    Raises:
        UserError: a mistake in the campaign, or nothing that could be an output.
    """
    form = read_toml(folder / "campaign.toml", CampaignForm)
    campaign = load_campaign(folder, only=names[:-1] or names)
    fit = list(campaign.recordings)
    guesses = {name: _as_guess(name, one, campaign, fit) for name, one in form.channels.items()}
    outputs = measured(campaign, fit)
    room = next((n for n, one in guesses.items() if one.role == "ambient temperature"), None)
    progress("looking for the inputs that drive the outputs")
    # a constant drives no error
    thermal = all(guesses[name].role != "other output" for name in outputs)
    drivers = strongest(campaign, fit, outputs, usual_inputs(guesses, room, thermal=thermal))
    files = {
        file: first_model(guesses, outputs, room, drivers, masses=masses)
        for file, masses in HAND_BUILT.values()
        if thermal
    }
    for file, text in files.items():
        write_atomic(folder / file, text)
    listed = ", ".join(f'"{name}"' for name in drivers)
    lines = {
        name: entry.replace("INPUTS", listed)
        for name, entry in CANDIDATES.items()
        if (drivers or "INPUTS" not in entry) and (thermal or name not in HAND_BUILT)
    }
    trial = experiment_text(title, [*fit, ""], outputs, lines, None, ()).replace(
        'held_out = [""]', "held_out = []"
    )
    write_atomic(folder / "experiment.toml", trial)
    experiment = load_experiment(folder / "experiment.toml")  # whatever is wrong with it is said now
    scores = [] if quick else choose(experiment, progress)
    lines |= NOT_TRIED
    return _decided(title, names, outputs, scores, lines, files, campaign, guesses, fit)


def measured(campaign: Campaign, fit: Sequence[str]) -> list[str]:
    """The errors and other outputs, and the temperatures if there is no error; without those that never move,
    if any moves.
    """
    found = predicted({name: channel.role for name, channel in campaign.channels.items()})
    return [name for name in found if _moves(campaign, fit, name)] or found


def predicted(roles: Mapping[str, str]) -> list[str]:
    """Names of what models predict, by the roles of all channels.

    >>> predicted({"I": "other input", "U": "other output", "T_cell": "temperature"})
    ['U', 'T_cell']
    """
    measured = ("error", "other output") if "error" in roles.values() else ("other output", "temperature")
    return [name for name, role in roles.items() if role in measured]


def _moves(campaign: Campaign, fit: Sequence[str], name: str) -> bool:
    known = np.concatenate([campaign.recordings[r].values[name] for r in fit])
    known = known[np.isfinite(known)]
    return bool(known.size and known.min() < known.max())


def _as_guess(name: str, form: ChannelForm, campaign: Campaign, fit: Sequence[str]) -> Guess:
    """A channel of the campaign, said by a person or guessed before."""
    fan = any(word.gloss == "fan" for word in words_of(name))
    quantity = "fan" if fan else "flow" if form.role == "fluid flow" else ""
    if is_irradiance(name, form.unit):
        quantity = SUN
    below = 0.0
    if form.role == "heat load":
        known = np.concatenate([campaign.recordings[r].values.get(name, np.empty(0)) for r in fit])
        known = known[np.isfinite(known)]
        below = below_zero(known).size / max(1, known.size)
    return Guess(form.role, form.unit, "", below_zero=below, quantity=quantity)


def _decided(
    title: str,
    names: Sequence[str],
    outputs: Sequence[str],
    scores: Sequence[Score],
    lines: Mapping[str, str],
    files: Mapping[str, str],
    campaign: Campaign,
    guesses: Mapping[str, Guess],
    fit: Sequence[str],
) -> Plan:
    if not scores:
        return _unchosen(title, names, outputs, lines, files)
    helping = [one.name for one in scores if one.helps]
    shares = [f"{one.name} {one.ratio:.0%}" for one in scores]
    how = "parts of it" if len(fit) == 1 else "recordings"
    remarks = [
        f"Chosen on {how} left out of the fit. rms there, relative to no model:",
        f"{', '.join(shares)}.",
    ]
    mismatch = next((name for name in HAND_BUILT if name in helping), None)
    if helping:
        references = [name for name in REFERENCES if name in lines]
        best = [helping[0], *([mismatch] if mismatch else []), *helping[:3]]
        chosen = list(dict.fromkeys([*best, *references]))
        said = [
            f"first model: {helping[0]}; on {how} left out of its fit, its rms is {scores[0].ratio:.0%} of "
            f"the rms without a model ({', '.join(shares[1:])})",
            f"  {helping[0]}: {FIRST_MODELS[helping[0]]}; `discovery list models` explains the others",
        ]
    else:
        chosen = [next(iter(lines))]
        remarks.append("None is better than no model: record more before you use one.")
        said = [
            f"no model is better than none on {how} left out ({', '.join(shares)})",
            *missing(campaign, fit, outputs, guesses),
        ]
    models = {name: lines[name].replace(", bootstraps = 0", "") for name in chosen}
    kept = {
        file: text for name, (file, _) in HAND_BUILT.items() if name in chosen for text in [files[file]]
    } or {file: text for file, text in files.items() if file == "model.toml"}
    head = "# Written by `discovery new`.\n"
    content = {file: head + text for file, text in kept.items()}
    content["experiment.toml"] = experiment_text(title, names, outputs, models, mismatch, remarks)
    return Plan(content, tuple(scores), tuple(said), models, mismatch)


def _unchosen(
    title: str,
    names: Sequence[str],
    outputs: Sequence[str],
    lines: Mapping[str, str],
    files: Mapping[str, str],
) -> Plan:
    """Return the simple model and a discovered one, without a comparison."""
    simple = "first_order" if files else next(iter(lines))
    references = [name for name in REFERENCES if name in lines]
    chosen = dict.fromkeys((simple, "discovered", *references))
    models = {name: lines[name].replace(", bootstraps = 0", "") for name in chosen}
    remarks = ["Not compared (--quick): `discovery new DIR --again` chooses by what each predicts."]
    mismatch = simple if files else None
    content = {f: "# Written by `discovery new`.\n" + text for f, text in files.items() if f == "model.toml"}
    content["experiment.toml"] = experiment_text(title, names, outputs, models, mismatch, remarks)
    return Plan(content, (), (), models, mismatch)


def missing(
    campaign: Campaign, fit: Sequence[str], outputs: Sequence[str], guesses: Mapping[str, Guess]
) -> list[str]:
    """What to record next where no model helps."""
    found = []
    loads = drives(guesses)
    still = [name for name in loads if not _moves(campaign, fit, name)]
    bodies = [n for n, one in guesses.items() if one.role == "temperature" and n not in outputs]
    if bodies:
        found.append(
            f"{', '.join(bodies)}: measured temperatures, which no model uses as inputs; "
            "give one the role 'other input' if the errors follow it"
        )
    if not loads and not any(one.role in FLUIDS for one in guesses.values()):
        found.append("record what heats the machine: a power, current, speed or switch")
    elif len(still) == len(loads):
        found.append(f"let {', '.join(still)} move while you record: steps of an hour or two, and pauses")
    for name in outputs:
        known = np.concatenate([campaign.recordings[r].values[name] for r in fit])
        known = known[np.isfinite(known)]
        if known.size < FEW:
            found.append(f"'{name}' has {known.size} readings: record longer, or read it more often")
        elif np.std(known) < _QUIET * np.median(np.abs(np.diff(known))) / 0.954:
            found.append(f"'{name}' hardly moves above its noise: load the machine more, or longer")
    if len(fit) == 1:
        found.append("record a second run with other loads: one run rarely separates the causes")
    return found
