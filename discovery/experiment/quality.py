"""The recordings of an experiment, looked at before anything is fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discovery.errors import UserError
from discovery.experiment.experiment import Experiment
from discovery.experiment.inputfiles import input_files
from discovery.files import read_toml
from discovery.recordings.campaignfile import CampaignForm
from discovery.recordings.check import check_campaign
from discovery.recordings.finding import Finding, folded

_SHOWN = 3  # errors in the sentence that refuses them


def quality(experiment: Experiment) -> list[Finding]:
    """What is wrong with the recordings that the experiment uses, alone and compared with each other."""
    used = {path.resolve() for path in input_files(experiment).values()}
    return [
        one
        for one in check_campaign(experiment.campaign.path, only=list(experiment.campaign.recordings))
        if one.file.resolve() in used
    ]


def refuse(findings: Sequence[Finding]) -> None:
    """Raises UserError where a recording cannot be used."""
    errors = [replace(one, severity="error") for one in findings if one.severity == "error"]
    if not errors:
        return
    lines = [line.removeprefix("error: ") for line in folded(errors)]
    rest = f"\n  and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    listed = "".join(f"\n  {line}" for line in lines[:_SHOWN])
    raise UserError(
        f"the recordings cannot be used; correct them, or say --force to use them anyway:{listed}{rest}"
    )


def guessed(experiment: Experiment) -> dict[str, str]:
    """What `discovery new` guessed of the channels and nobody has confirmed, by channel."""
    form = read_toml(experiment.campaign.path, CampaignForm)
    found = {name: one.guessed for name, one in form.channels.items() if one.guessed}
    return found | ({"time": form.guessed} if form.guessed else {})
