"""The files that an experiment reads, by the names that they have in results.json."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from discovery.experiment.experiment import Experiment
from discovery.experiment.form import FileEntry
from discovery.files import read_toml
from discovery.recordings.campaignfile import CampaignForm
from discovery.sparse.options import SparseOptions


def input_files(experiment: Experiment) -> dict[str, Path]:
    """Every file that the experiment reads."""
    files = {experiment.path.name: experiment.path, **recording_files(experiment)}
    for entry in experiment.form.models.values():
        match entry:
            case FileEntry(file=name) | SparseOptions(built_on_file=True, baseline=name):
                files[name] = experiment.path.parent / name
    paper = experiment.form.paper
    if paper is not None and paper.left_nozzle is not None:
        files[paper.left_nozzle] = experiment.path.parent / paper.left_nozzle
    return files


def recording_files(experiment: Experiment) -> dict[str, Path]:
    """The campaign and the recordings that the experiment uses."""
    campaign = experiment.campaign.path
    form = read_toml(campaign, CampaignForm)
    return {campaign.name: campaign} | {
        form.recordings[name].file: campaign.parent / form.recordings[name].file
        for name in experiment.campaign.recordings
    }


def hashes(files: Mapping[str, Path]) -> dict[str, str]:
    """SHA-256 of each file."""
    found = {}
    for name, path in files.items():
        with path.open("rb") as file:
            found[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return found
