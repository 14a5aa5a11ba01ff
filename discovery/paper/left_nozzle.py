"""Figure 8 of section 3, the nozzle on the left: what changed, where, and a model that knows it.

The experiment of the left nozzle is run in full. Its diagnosis is made twice: with the channel that says
where the nozzle points, and with that channel hidden, as on a machine where nobody wrote it down.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from discovery.diagnosis import Diagnosis
from discovery.diagnosis.thresholds import RIVAL
from discovery.errors import UserError
from discovery.evaluation.tables import Table
from discovery.experiment.experiment import Experiment, load_experiment
from discovery.experiment.fitted import Fitted
from discovery.experiment.modelfits import fit_entry
from discovery.experiment.pipeline import diagnosis, repaired_of
from discovery.paper.chapter import Chapter, Material
from discovery.printed import printed
from discovery.report.chart import Chart, Panel, Series

SIDE = "nozzle side"  # role of the channel that is hidden
RECORDED, HIDDEN = "nozzle side recorded", "nozzle side hidden"


@dataclass(frozen=True)
class Case:
    """The diagnosis with what the recordings say of the nozzle, and the repaired model where it names one."""

    label: str
    found: Diagnosis
    repaired: Fitted | None


def left_nozzle(m: Material) -> Chapter | None:
    """The nozzle on the left as a case of its own: located, named, modelled, judged on unseen recordings."""
    if m.form.left_nozzle is None:
        return None
    experiment = load_experiment(m.experiment.path.parent / m.form.left_nozzle)
    if experiment.form.mismatch is None:
        raise UserError(f"{experiment.path}: name the model to diagnose under [mismatch]")
    models = {name: fit_entry(experiment, name, entry) for name, entry in experiment.form.models.items()}
    ways = {RECORDED: experiment, HIDDEN: without_side(experiment)}
    if all(channel.role != SIDE for channel in experiment.campaign.channels.values()):
        del ways[RECORDED]
    cases = [_case(label, one, models) for label, one in ways.items()]
    for case in cases:
        if case.repaired is not None:
            models[f"repaired, {case.label}"] = case.repaired
    unseen = experiment.held_out
    made = {r: experiment.campaign.recordings[r].note for r in experiment.fit}
    notes = [f"How '{r}' was made: {note}." for r, note in made.items() if note]
    return Chapter(
        "left-nozzle",
        "Nozzle on the left (figure 8, table 1): what changed, and where",
        "The outlet is moved to the left, so that most of the fluid is spread on the structure. The model "
        "is not changed; E_A0C improves by 32 % instead of 60 %.",
        (_named(cases), _rms(experiment, models)),
        _charts(m, experiment, models),
        (*notes, *(line for case in cases for line in _says(case, unseen))),
        (
            "What the model has no body for: fluid on a cover shows as fluid on the bodies that carry the "
            "cover.",
            "The start: only the first reading says how warm an unseen machine was, so its first hours "
            "may be the largest part of what the repaired models leave.",
            "The machine of the paper: it prints no figures of where the fluid went.",
        ),
    )


def without_side(experiment: Experiment) -> Experiment:
    """The experiment as if nobody had recorded where the nozzle points."""
    campaign = experiment.campaign
    channels = {name: channel for name, channel in campaign.channels.items() if channel.role != SIDE}
    return replace(experiment, campaign=replace(campaign, channels=channels))


def _case(label: str, experiment: Experiment, models: Mapping[str, Fitted]) -> Case:
    found = diagnosis(experiment, lambda _: None, models)
    assert found is not None
    repaired = found.repaired
    name = f"repaired, {label}"
    return Case(label, found, repaired_of(experiment, name, found, repaired) if repaired else None)


def _named(cases: list[Case]) -> Table:
    """What each diagnosis names, with the size at each place."""
    rows: list[tuple[str | float | None, ...]] = []
    for case in cases:
        for n in case.found.verdict.named:
            h = n.hypothesis
            for k, name in enumerate(h.amplitudes):
                assert case.found.after is not None
                place = h.states[k] if len(h.amplitudes) > 1 else ", ".join(h.places)
                value = case.found.after.model.parameters[name]
                low, high = case.found.interval(h, name)
                rows.append(
                    (case.label, h.effect.title, place, value.value, low, high, value.unit, n.probability)
                )
    header = ("Nozzle", "named", "where", "size", "low", "high", "unit", "probability")
    return Table("What the diagnosis names, with 95 % intervals", header, tuple(rows))


def _rms(experiment: Experiment, models: Mapping[str, Fitted]) -> Table:
    """rms of every error on every recording, uncompensated and by each model."""
    rows: list[tuple[str | float | None, ...]] = []
    for recording in (*experiment.fit, *experiment.held_out):
        label = recording if recording in experiment.fit else f"{recording} (unseen)"
        found = {
            n: f.predictions[recording].scores() for n, f in models.items() if recording in f.predictions
        }
        raw = {e: one[e]["uncompensated"]["rms"] for one in found.values() for e in one}
        rows.append((label, "uncompensated", *(raw.get(e) for e in experiment.outputs)))
        for name, scores in found.items():
            rows.append((label, name, *(scores.get(e, {}).get("rms") for e in experiment.outputs)))
    units = [experiment.campaign.channels[e].unit for e in experiment.outputs]
    header = ("rms", "model", *(f"{e} [{u}]" for e, u in zip(experiment.outputs, units, strict=True)))
    return Table("Models fitted to both sides, in free runs", header, tuple(rows))


def _says(case: Case, unseen: tuple[str, ...]) -> Iterator[str]:
    """Verdict, places and proof of a case, and what else explains the recordings as well."""
    named = case.found.verdict.named
    where = "; ".join(f"{n.hypothesis.effect.title}: {n.hypothesis.where}" for n in named)
    yield f"{case.label}: {case.found.verdict.word}" + (f" ({where})." if where else ".")
    proof = {r: i for r, i in case.found.held_out.items() if r in unseen}
    if named and proof:
        runs = ", ".join(f"{r} {printed(i.before)} → {printed(i.after)}" for r, i in proof.items())
        yield f"{case.label}: rms over the reading noise on unseen recordings: {runs}."
    near = [(n, r) for n in named for r in n.rivals if r.below <= RIVAL]
    for n, rival in near:
        other = f"{rival.hypothesis.effect.title}: {rival.hypothesis.where}"
        yield f"{case.label}: in place of {n.hypothesis.where} it could as well be {other}."
    for reason in case.found.verdict.reasons:
        yield f"{case.label}: {reason}."


def _charts(m: Material, experiment: Experiment, models: Mapping[str, Fitted]) -> tuple[Chart, ...]:
    """Return readings minus models on the last recording, a held-out one if there is any."""
    recording = (*experiment.fit, *experiment.held_out)[-1]
    charts = []
    for error in experiment.outputs:
        curves = []
        for k, (name, fitted) in enumerate(models.items()):
            p = fitted.predictions.get(recording)
            if p is None or error not in p.outputs:
                continue
            y, hours = p.outputs.index(error), (p.time - p.time[0]) / 3600.0
            read = np.isfinite(p.readings[:, y])
            left = (p.readings - p.predicted)[read, y]
            curves.append(Series(name, hours[read], left, "line", str(k)))
        panel = Panel(f"{error} [{m.unit(error)}]", tuple(curves), zero=True)
        charts.append(
            Chart(
                f"left-nozzle-{error}", f"{error} on {recording}: reading minus model", "time [h]", (panel,)
            )
        )
    return tuple(charts)
