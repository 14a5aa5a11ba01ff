"""Section 6 of the paper, further steps: models are recalibrated, with a test piece in place of an R-Test.

The features of a test piece are readings, but few: each is one error at one instant. From R-Test readings of
a recording some are kept, one error in turn, and `discovery update` compares the model at work with these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discovery.dynamics import predict
from discovery.evaluation.criteria import criteria
from discovery.evaluation.tables import Table
from discovery.export.document import from_document, render
from discovery.export.seal import open_seal
from discovery.fitting import predict_recording
from discovery.models import Model
from discovery.paper.active import exported_of
from discovery.paper.chapter import Chapter, Material
from discovery.recordings import Recording
from discovery.runtime.hypotheses import compare
from discovery.runtime.update import MAY, revision_of

FEATURES_A_DAY = (12, 24)


def recalibration(m: Material) -> Chapter | None:
    """What few readings of each recording say of the model at work, and what its next revision is worth."""
    if not m.form.test_piece:
        return None
    campaign = m.experiment.campaign
    exported = exported_of(m.fitted[m.form.thermobalance].model, campaign, m.results["fit"])
    answers: list[tuple[str | float | None, ...]] = []
    rms: list[tuple[str | float | None, ...]] = []
    shows = []
    for recording in m.form.test_piece:
        rms.append((recording, "at work", *_left(m, exported.model, recording)))
        for a_day in FEATURES_A_DAY:
            few = features(campaign.recordings[recording], m.errors, a_day)
            pieces = replace(campaign, recordings={recording: few})
            found = compare(exported, pieces, [recording])
            revised = revision_of(exported, pieces, found)
            answers.append(
                (recording, a_day, found.readings, found.verdict, found.rms, revised and revised[1])
            )
            says = "the model is kept"
            if revised:
                says = "a next revision is written"
                data = render(revised[0])
                after = from_document(*open_seal(data, exported.model.name), exported.model.name).model
                rms.append((recording, f"revised, {a_day} a day", *_left(m, after, recording)))
            answer = "no change" if found.verdict == "nothing" else found.verdict
            shows.append(f"{recording}, {a_day} features a day: {answer}; {says}.")
    header = ("rms", "model", *(f"{e} [{m.unit(e)}]" for e in m.errors))
    return Chapter(
        "test-piece",
        "Section 6: recalibration from a test piece",
        "The thermal behaviour changes through wear, so models have to be recalibrated occasionally; an "
        "iterative model update and a thermal test piece are announced, without figures.",
        (
            Table(
                "What the features say; residual in units of that of the fit",
                ("Recording", "a day", "features", "answer", "residual", "after the revision"),
                tuple(answers),
            ),
            Table("All R-Test readings of the recording, in a free run", header, tuple(rms)),
        ),
        shows=(*_notes(m), *shows),
        not_shown=(
            "The error of cutting and measuring a feature: it counts as noise of an R-Test reading.",
            f"A revision is written only if it leaves less than {MAY:g} times the residual before: "
            "few features may show wear and still not say enough of it.",
        ),
    )


def features(recording: Recording, errors: Sequence[str], a_day: int) -> Recording:
    """The recording with so many readings a day left, evenly over its readings, one error in turn."""
    read = np.flatnonzero(np.any([np.isfinite(recording.values[e]) for e in errors], axis=0))
    count = max(len(errors), round(a_day * float(np.ptp(recording.time)) / 86400.0))
    kept = read[np.linspace(0, len(read) - 1, min(count, len(read))).astype(int)]
    values = dict(recording.values)
    for k, error in enumerate(errors):
        mine = kept[k :: len(errors)]
        few = np.full(len(recording.time), np.nan)
        few[mine] = values[error][mine]
        values[error] = few
    return replace(recording, values=values)


def _left(m: Material, model: Model, recording: str) -> list[float]:
    """rms of reading minus model by error, over all readings."""
    fit = m.fitted[m.form.thermobalance].fit
    run = predict_recording(model, m.experiment.campaign, recording, m.errors, fit.noise.white)
    left = run.system.grid.readings - predict(run)
    return [criteria(column).rms for column in left.T]


def _notes(m: Material) -> list[str]:
    recordings = {r: m.experiment.campaign.recordings[r].note for r in m.form.test_piece}
    return [f"How '{r}' was made: {note}." for r, note in recordings.items() if note]
