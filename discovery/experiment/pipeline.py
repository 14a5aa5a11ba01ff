"""The main job, top to bottom: load, fit, predict, judge, cross-validate, diagnose, write."""

from __future__ import annotations

import time as clock
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discovery.errors import UserError
from discovery.experiment.experiment import Experiment, compared_on_all, load_experiment
from discovery.experiment.fitted import Fitted, judged
from discovery.experiment.form import (
    ExportForm,
    MismatchForm,
    ModelEntry,
)
from discovery.experiment.joining import check_joins, join
from discovery.experiment.lasttime import with_time_left
from discovery.experiment.modelfits import fit_entry
from discovery.experiment.quality import quality, refuse
from discovery.experiment.results import results_document, write_run
from discovery.fitting.fit import written_with
from discovery.models import Model
from discovery.printed import counted
from discovery.progress import Progress, silent
from discovery.recordings.finding import Finding, folded
from discovery.report import write_report
from discovery.runfolder import default_folder, replacing, staged
from discovery.sparse.options import SparseOptions
from discovery.targets import check_targets
from discovery.threads import one_thread, side_by_side

if TYPE_CHECKING:
    from discovery.diagnosis import Diagnosis
    from discovery.experiment.roles import Fold
    from discovery.paper.chapter import Chapter


@one_thread
def run(
    path: Path,
    out: Path | None = None,
    progress: Progress = silent,
    *,
    force: bool = False,
    tell: Progress = silent,
) -> Path:
    """Do what an experiment file says and write the results folder.

    Args:
        path: the experiment file.
        out: folder of the results; default runs/<experiment name>. The results in it are replaced as a whole
            at the very end, so an interrupted run leaves what was there before; exports, figures and
            whatever else stands there stay.
        progress: called with what begins.
        force: use recordings that are wrong all the same.
        tell: called with what is wrong with the recordings and with what is replaced, a line each.

    Returns:
        The folder.

    Raises:
        UserError: a mistake in a file, recordings that cannot be used, a model that cannot be fitted, or
            one that
            cannot be exported; then the run is kept.
    """
    began = clock.perf_counter()
    experiment, findings = _looked_at(path, progress, tell, force=force)
    folder = out or default_folder(experiment.name)
    if experiment.form.export:
        check_targets(experiment.form.export.to)
    if lost := replacing(folder):
        tell(lost)
    progress = with_time_left(progress, folder, experiment, began)
    with staged(folder) as temporary:
        begun = begin_roles(experiment)
        fitted = fit_all(experiment, progress)
        found = diagnosis(experiment, progress, fitted)
        if found is not None and found.repaired is not None:
            name = _free_name("repaired", fitted)
            fitted[name] = repaired_of(experiment, name, found, found.repaired, progress)
        made = paper_chapters(experiment, fitted, findings, progress)  # while folds are under way
        further = roles_of(experiment, begun, progress)
        progress("writing the report")
        if experiment.form.paper:
            further |= paper_page(temporary, experiment, made, further)
        seconds = clock.perf_counter() - began
        write_run(temporary, "run", experiment, fitted, _written(found), seconds, findings, further)
        write_report(temporary)
    if experiment.form.export:
        progress(f"exporting {experiment.form.export.model}")
        export_of(folder, experiment.form.export)
    return folder


def _looked_at(
    path: Path, progress: Progress, tell: Progress, *, force: bool
) -> tuple[Experiment, list[Finding]]:
    """Return an experiment and the findings in its recordings. They are printed before any fit."""
    progress("reading the recordings")
    experiment = compared_on_all(load_experiment(path))
    progress("comparing the recordings with each other")
    findings = quality(experiment)
    if not force:
        refuse(findings)
    for line in folded(findings):
        tell(line)
    return experiment, findings


def _weight(entry: ModelEntry) -> float:
    """Return how long a model takes, relative to a model that is only fitted."""
    return 3.0 if isinstance(entry, SparseOptions) else 1.0


def fit_all(experiment: Experiment, progress: Progress = silent) -> dict[str, Fitted]:
    """Every model of the experiment, in the order of its file. Models know nothing of each other, so they are
    fitted side by side, the longest first. Progress says how many are done, and not how long the rest takes:
    no model says how long another one takes.
    """
    models, done = experiment.form.models, list[str]()

    def counting(what: str) -> None:
        progress(f"{what} ({len(done)} of {counted(len(models), 'model')} done)")

    def fitted(name: str) -> Fitted:
        one = fit_entry(experiment, name, models[name], counting)
        done.append(name)
        return one

    order = sorted(models, key=lambda name: -_weight(models[name]))
    found = dict(zip(order, side_by_side(fitted, order), strict=True))
    return {name: found[name] for name in models}


def begin_roles(experiment: Experiment) -> Iterator[Fold] | None:
    """Folds of the cross-validation over roles, under way during the fits of the experiment itself."""
    if experiment.form.roles is None:
        return None
    from discovery.experiment.roles import begin_folds

    return begin_folds(experiment)


def roles_of(experiment: Experiment, begun: Iterator[Fold] | None, progress: Progress) -> dict[str, Any]:
    """What results.json holds of the roles; nothing where the experiment names none."""
    if begun is None:
        return {}
    from discovery.experiment.roles import leave_roles_out

    progress("leaving out one role after the other")
    return {"role_matrix": leave_roles_out(experiment, begun, progress)}


def paper_chapters(
    experiment: Experiment,
    fitted: Mapping[str, Fitted],
    findings: Sequence[Finding],
    progress: Progress = silent,
) -> list[Chapter]:
    """The chapters of paper.html, all but that of the roles; none where the experiment has no [paper]."""
    if experiment.form.paper is None:
        return []
    from discovery.paper.page import chapters

    document = results_document("run", experiment, fitted, 0.0, findings)
    return chapters(experiment, fitted, document.model_dump(exclude_unset=True), progress)


def paper_page(
    folder: Path, experiment: Experiment, made: Sequence[Chapter], further: Mapping[str, Any]
) -> dict[str, Any]:
    """Write paper.html; what results.json holds of it.

    Args:
        further: what results.json holds of the roles.
    """
    from discovery.paper.chapter import attempted
    from discovery.paper.page import role_chapter, write_page

    if further:
        channels = experiment.campaign.channels
        last = attempted("validation", lambda: role_chapter(further["role_matrix"], channels))
        made = [*made, *([last] if last else [])]
    write_page(folder, experiment, made)
    return {"paper": {one.key: one.document() for one in made}}


def export_of(folder: Path, wanted: ExportForm) -> None:
    """Export what [export] asks for, out of the run that stands in `folder`. Raises UserError, which says
    that the run is kept.
    """
    from discovery.export import export_run

    try:
        export_run(folder, wanted.model, wanted.to)
    except UserError as error:
        raise UserError(f"the run is done and kept in {folder}, but its export failed: {error}") from None


def diagnose(
    path: Path,
    out: Path | None = None,
    progress: Progress = silent,
    *,
    force: bool = False,
    tell: Progress = silent,
) -> Path:
    """What the model of [mismatch] leaves out, alone: that model, the diagnosis, the repaired one, a report.

    Without [mismatch] the experiment's only (or first) model is taken. Files, arguments and failures as in
    `run`; other models that a run left in the folder stay there (see `joining`).
    """
    began = clock.perf_counter()
    experiment, findings = _looked_at(path, progress, tell, force=force)
    form = experiment.form
    asked = form.mismatch or MismatchForm(model=next(iter(form.models)))
    name, entry = asked.model, form.models[asked.model]
    alone = {"models": {name: entry}, "mismatch": asked, "cross_validate": False, "export": None}
    experiment = replace(experiment, form=form.model_copy(update=alone))
    folder = out or default_folder(experiment.name)
    check_joins(folder, experiment, name)
    if lost := replacing(folder, "diagnose"):
        tell(lost)
    with staged(folder) as temporary:
        fitted = {name: fit_entry(experiment, name, entry, progress)}
        found = diagnosis(experiment, progress, fitted)
        assert found is not None
        if found.repaired is not None:
            name = _free_name("repaired", form.models)
            fitted[name] = repaired_of(experiment, name, found, found.repaired, progress)
        progress("writing the report")
        seconds = clock.perf_counter() - began
        write_run(temporary, "diagnose", experiment, fitted, _written(found), seconds, findings)
        join(folder, temporary)
        write_report(temporary)
    return folder


def _written(found: Diagnosis | None) -> dict[str, Any] | None:
    """Return a diagnosis as its file holds it, without parts that do not apply."""
    return found.document().model_dump(exclude_unset=True) if found else None


def _free_name(wanted: str, taken: Collection[str]) -> str:
    """A name that no model of the experiment has."""
    return wanted if wanted not in taken else _free_name(f"{wanted}_", taken)


def repaired_of(
    experiment: Experiment, name: str, found: Diagnosis, repaired: Model, progress: Progress = silent
) -> Fitted:
    """The repaired model of a diagnosis with the very numbers that the diagnosis found and proved."""
    if (wanted := experiment.form.mismatch) is not None:
        experiment = experiment.seen_by(experiment.form.models[wanted.model])
    assert found.after is not None
    fit = written_with(found.after, repaired, experiment.fitting)
    return judged(experiment, name, "repaired", repaired, fit, None, found.seconds, progress)


def diagnosis(experiment: Experiment, progress: Progress, fitted: Mapping[str, Fitted]) -> Diagnosis | None:
    """What the model of [mismatch] leaves out, where the experiment asks.

    Args:
        fitted: models of the experiment; the proof compares with the one that is diagnosed.
    """
    wanted = experiment.form.mismatch
    if wanted is None:
        return None
    from discovery.diagnosis import diagnose as find_missing

    name, entry = wanted.model, experiment.form.models[wanted.model]
    experiment = experiment.seen_by(entry)
    progress(f"looking for what {name} leaves out")
    start = fitted[name].start
    by_hand = entry.kind in ("file", "thermobalance")  # a program chose the start values of any other kind
    return find_missing(
        start if by_hand else replace(start, guessed=True),
        experiment.campaign,
        experiment.fit,
        experiment.held_out,
        experiment.outputs_of(entry),
        [form.effect() for form in wanted.effects],
        fitted=fitted[name].fit,
        tell=progress,
    )
