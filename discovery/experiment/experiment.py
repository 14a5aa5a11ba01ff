"""The experiment: its file with its recordings loaded, and what no form can say of it checked."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import cast

import numpy as np

from discovery.errors import UserError
from discovery.experiment.form import ExperimentForm, FileEntry, ModelEntry, own_recordings, separate
from discovery.files import dotted, locate, read_text, read_toml
from discovery.models import Model, check_model, read_model
from discovery.models.check import check_outputs
from discovery.recordings import Campaign, load_campaign
from discovery.recordings.campaignfile import CampaignForm, campaign_path
from discovery.recordings.twins import twins
from discovery.schema import suggest

_INPUT_ROLES = (
    "ambient temperature",
    "heat load",
    "fluid temperature",
)  # of eqs. (8) and (9), in the paper's order
OUTPUTS = (
    "error",
    "temperature",
    "other output",
)  # roles, of which the first one recorded is modelled by default
_ELSE = ("rotation speed", "other input")


@dataclass(frozen=True)
class Experiment:
    """An experiment with its recordings loaded.

    Whatever fits, chooses or sets a threshold gets `fitting`, which holds the recordings to fit and no other:
    the held-out ones are not there to be looked at.
    """

    form: ExperimentForm
    path: Path
    campaign: Campaign  # everything, for free runs at the end
    outputs: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the experiment."""
        return self.form.name

    @property
    def fit(self) -> tuple[str, ...]:
        """Recordings to fit."""
        return tuple(self.form.fit)

    @property
    def held_out(self) -> tuple[str, ...]:
        """Recordings that no fit sees."""
        return tuple(self.form.held_out)

    @cached_property
    def fitting(self) -> Campaign:
        """The campaign as fits see it."""
        return only(self.campaign, self.fit)

    def seen_by(self, entry: ModelEntry) -> Experiment:
        """The experiment as a model has it that is fitted to further recordings."""
        also = [name for name in getattr(entry, "also", ()) if name not in self.fit]
        if not also:
            return self
        return replace(self, form=self.form.model_copy(update={"fit": [*self.fit, *also]}))

    def inputs(self, entry: ModelEntry) -> list[str]:
        """Inputs of a built model: those stated, else the channels of the roles that the paper uses.

        Where no heat load is recorded, speeds and other inputs say what heats the machine.
        """
        stated = getattr(entry, "inputs", None)
        if stated:
            return list(stated)
        channels = [c for c in self.campaign.channels.values() if c.is_input]
        roles = _INPUT_ROLES if any(c.role == "heat load" for c in channels) else (*_INPUT_ROLES, *_ELSE)
        usual = [c.name for role in roles for c in channels if c.role == role]
        moving = [name for name in usual if self._moves(name)]
        return moving or usual or [c.name for c in channels]

    def _moves(self, name: str) -> bool:
        """Return whether a channel moves in the recordings to fit. The ambient temperature always counts."""
        if self.campaign.channels[name].role == _INPUT_ROLES[0]:
            return True
        pieces = [self.campaign.recordings[r].values.get(name, np.empty(0)) for r in self.fit]
        known = np.concatenate([piece[np.isfinite(piece)] for piece in pieces])
        return bool(len(known) and known.min() < known.max())

    def outputs_of(self, entry: ModelEntry) -> list[str]:
        """Outputs that a model is built for, or compared on."""
        return list(getattr(entry, "outputs", None) or self.outputs)

    def model_file(self, name: str) -> Model:
        """The model that entry `name` reads from its file, checked against the campaign. Raises UserError."""
        entry = cast(FileEntry, self.form.models[name])
        path = self.path.parent / entry.file
        model = read_model(path)
        check_model(model, {n: c.unit for n, c in self.campaign.channels.items()}, path)
        check_outputs(model, self.campaign.channels, path)
        given = [*model.outputs, *model.states]
        for output in entry.outputs or []:
            if output not in given:
                what = f"{entry.file} gives no '{output}'; {suggest(output, list(model.outputs))}"
                raise _mistake(self.path, ("models", name), what)
        return model


def compared_on_all(experiment: Experiment) -> Experiment:
    """The experiment in which each model file is compared with everything measured that it gives, where
    nobody states outputs: what is read at its bodies tells causes apart that errors alone cannot. Models that
    the program builds keep their outputs.

    Raises UserError: a model cannot be read, or does not fit the campaign.
    """
    form, usual = experiment.form, list(experiment.outputs)
    if form.outputs:
        return experiment
    open_ones = {name: entry for name, entry in form.models.items() if not getattr(entry, "outputs", None)}
    files = [name for name, entry in open_ones.items() if entry.kind == "file"]
    more = list(dict.fromkeys(output for name in files for output in _given(experiment, name)))
    if not more:
        return experiment
    built = {n: e.model_copy(update={"outputs": usual}) for n, e in open_ones.items() if n not in files}
    models = {name: built.get(name, entry) for name, entry in form.models.items()}
    return replace(experiment, form=form.model_copy(update={"models": models}), outputs=(*usual, *more))


def _given(experiment: Experiment, name: str) -> list[str]:
    """What a model file gives and the recordings to fit measure, but for the outputs."""
    model, channels = experiment.model_file(name), experiment.campaign.channels
    known = {*experiment.outputs, *model.inputs}
    there = [n for n in dict.fromkeys([*model.outputs, *model.states]) if n in channels and n not in known]
    return [n for n in there if channels[n].measured and not experiment.campaign.unread(experiment.fit, [n])]


def only(campaign: Campaign, names: Collection[str]) -> Campaign:
    """The campaign with the recordings of these names alone."""
    return replace(
        campaign,
        recordings={name: campaign.recordings[name] for name in campaign.recordings if name in names},
    )


def load_experiment(path: str | os.PathLike[str]) -> Experiment:
    """The experiment at `path` with its campaign.

    Raises UserError: a mistake in the experiment, the campaign or a recording, with file, line, what to do.
    """
    path = Path(path)
    form = read_toml(path, ExperimentForm)
    campaign = load_campaign(path.parent / form.campaign, only=_recordings(path, form))
    outputs = form.outputs or next((found for role in OUTPUTS if (found := _of_role(campaign, role))), [])
    if not outputs:
        measured = ", ".join(c.name for c in campaign.channels.values() if c.measured)
        roles = " or ".join(f'"{role}"' for role in OUTPUTS)
        raise UserError(
            f"{path}: no channel of {campaign.path} has the role {roles}; "
            f"say outputs = [...] with some of {measured}"
        )
    _check(path, form, campaign, outputs)
    return Experiment(form, path, campaign, tuple(outputs))


def _recordings(path: Path, form: ExperimentForm) -> list[str]:
    """Return the recordings to load. Raises UserError if the campaign does not have one of them."""
    known = list(read_toml(campaign_path(path.parent / form.campaign), CampaignForm).recordings)
    named: dict[str, tuple[str, ...]] = dict.fromkeys(form.fit, ("fit",))
    named |= dict.fromkeys(form.held_out, ("held_out",))
    for model, entry in form.models.items():
        named |= {name: ("models", model) for _, name in own_recordings(entry) if name not in named}
    for role, recordings in (form.roles or {}).items():
        named |= {name: ("roles", role) for name in recordings if name not in named}
    if form.paper:
        named |= {name: ("paper", key) for key, name in form.paper.recordings() if name not in named}
    for name, key in named.items():
        if name not in known:
            raise _mistake(path, key, f"no recording '{name}'; {suggest(name, known)}")
    return list(named)


def _of_role(campaign: Campaign, role: str) -> list[str]:
    return [c.name for c in campaign.channels.values() if c.role == role]


def _check(path: Path, form: ExperimentForm, campaign: Campaign, outputs: Collection[str]) -> None:
    """Check what a schema cannot: names that must exist elsewhere. Raises UserError."""
    channels = list(campaign.channels)
    measured = [name for name in channels if campaign.channels[name].measured]
    both = [name for name in form.fit if name in form.held_out]
    if both:
        raise _mistake(
            path, ("held_out",), f"'{both[0]}' is also in fit; a fitted recording cannot be held out"
        )
    for name in outputs:
        if name not in measured:
            raise _mistake(path, ("outputs",), f"'{name}' is no measured channel; {suggest(name, measured)}")
    if what := campaign.unread_to_fit(form.fit, outputs):
        raise _mistake(path, ("fit",), what)
    for model, entry in form.models.items():
        key = ("models", model)
        for name in [*(getattr(entry, "inputs", None) or []), *separate(entry)]:
            if name not in channels:
                raise _mistake(path, key, f"no channel '{name}'; {suggest(name, channels)}")
            if entry.kind != "sindy" and name in (entry.outputs or outputs):
                raise _mistake(path, key, f"inputs: '{name}' is an output of this model; take it out of one")
        for name in getattr(entry, "outputs", None) or []:
            if name not in outputs:
                raise _mistake(
                    path, key, f"'{name}' is not an output of the experiment; {suggest(name, list(outputs))}"
                )
        for word, name in own_recordings(entry):
            if name in form.held_out:
                raise _mistake(path, key, f"{word}: '{name}' is held out; a fit must not see it")
    alone = [name for entry in form.models.values() for _, name in own_recordings(entry)]
    for one, other in twins(campaign, form.held_out, [*form.fit, *alone]):
        what = f"'{one}' holds the same readings as '{other}', which is fitted; hold out another recording"
        raise _mistake(path, ("held_out",), what)
    _check_roles(path, form, campaign, outputs)
    for word, name in form.paper.models() if form.paper else []:
        if name not in form.models:
            raise _mistake(path, ("paper", word), f"no model '{name}'; {suggest(name, list(form.models))}")
    if form.paper and form.paper.left_nozzle and not (path.parent / form.paper.left_nozzle).is_file():
        raise _mistake(path, ("paper", "left_nozzle"), f"there is no experiment '{form.paper.left_nozzle}'")
    for section in ("mismatch", "export"):
        chosen = getattr(form, section)
        if chosen and chosen.model not in form.models:
            raise _mistake(
                path,
                (section, "model"),
                f"no model '{chosen.model}'; {suggest(chosen.model, list(form.models))}",
            )


def _check_roles(path: Path, form: ExperimentForm, campaign: Campaign, outputs: Collection[str]) -> None:
    """One role for each recording, and no copy of a recording in another role: a fold would have seen what it
    is judged on. Raises UserError.
    """
    roles = form.roles or {}
    taken: dict[str, str] = {}
    for role, recordings in roles.items():
        for name in recordings:
            if name in taken:
                what = f"'{name}' plays '{taken[name]}' too; a recording has one role"
                raise _mistake(path, ("roles", role), what)
            taken[name] = role
    for role, recordings in roles.items():
        others = [name for other, names in roles.items() if other != role for name in names]
        for one, other in twins(campaign, recordings, others):
            what = f"'{one}' holds the same readings as '{other}' of another role; leave one out"
            raise _mistake(path, ("roles", role), what)
        if what := campaign.unread(others, outputs):
            raise _mistake(path, ("roles", role), f"without this role, {what}")


def _mistake(path: Path, key: tuple[str | int, ...], what: str) -> UserError:
    return UserError(f"{path}, line {locate(read_text(path), key)}: {dotted(key)}: {what}")
