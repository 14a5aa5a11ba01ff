"""Equation (8) as the paper identifies it, heat and fluid of each recording, and the matrix of the roles."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from discovery.evaluation.budget import budget
from discovery.evaluation.tables import Table, budget_tables
from discovery.experiment.form import separate
from discovery.fitting import predict_recording
from discovery.paper.chapter import Chapter, Material

_COLUMNS = 5  # recordings in a table of budgets


def equation_8(m: Material) -> Chapter:
    """Each influence from its own recordings; hours against eq. (9); the load of a dry machine."""
    name = m.form.superposition
    own = separate(m.experiment.form.models[name])
    rows: list[tuple[str | float | None, ...]] = [
        (u, ", ".join(recordings), _hours(m, recordings)) for u, recordings in own.items()
    ]
    apart = _hours(m, {r for one in own.values() for r in one})
    together = _hours(m, m.results["fit"])
    tables = [
        Table(
            f"'{name}': recordings that each influence comes from",
            ("Input", "recordings", "hours"),
            tuple(rows),
        )
    ]
    shows = [
        f"Equation (8) took {apart:.0f} h of recordings ({apart / 24:.1f} days), equation (9) "
        f"{together:.0f} h "
        "(paper: about 10 days against 72 h)."
    ]
    cooling = m.form.cooling
    if cooling:
        compared, _ = _compared(m, name, cooling, "The load as drive power and as axis cooling power")
        tables.append(compared)
    dry = m.form.dry_load
    if dry:
        compared, worst = _compared(m, name, dry, "Load identified on a wet and on a dry machine")
        tables.append(compared)
        if worst:
            error, ours, theirs = worst
            shows.append(
                f"With the load identified on a dry machine, {error} is left with {theirs:.1f} "
                f"{m.unit(error)} rms on unseen "
                f"recordings, with the load from a wet one {ours:.1f}: fluid carries away heat that a "
                "dry table keeps, so "
                "the gain of a dry machine is too large and its time constant another. Influences do not "
                "simply add up."
            )
    return Chapter(
        "equation-8",
        "Equation (8): one influence after the other",
        "Environment first, then fluid or internal losses, the known influences compensated; u₁ "
        "environment, u₂ axis "
        "cooling power, u₃ fluid temperature. About 10 days of measurement.",
        tuple(tables),
        shows=tuple(shows),
        not_shown=(
            "How the paper kept the other influences still while one was investigated; it does not say so.",
        ),
    )


def _hours(m: Material, recordings: Any) -> float:
    return sum(float(np.ptp(m.experiment.campaign.recordings[r].time)) for r in recordings) / 3600.0


def _compared(m: Material, wet: str, dry: str, title: str) -> tuple[Table, tuple[str, float, float] | None]:
    """rms of both on the unseen recordings, and the error with the largest ratio, pooled over these."""
    rows: list[tuple[str | float | None, ...]] = []
    pooled: dict[str, dict[str, list[float]]] = {}
    for recording in m.judged_on():
        for name in (wet, dry):
            scores = m.results["models"][name]["recordings"].get(recording, {})
            rows.append((recording, name, *(scores[e]["rms"] if e in scores else None for e in m.errors)))
            for e in scores:
                pooled.setdefault(e, {}).setdefault(name, []).append(scores[e]["rms"])
    header = ("rms", "model", *(f"{e} [{m.unit(e)}]" for e in m.errors))
    mean = {
        e: (float(np.sqrt(np.mean(np.square(one[wet])))), float(np.sqrt(np.mean(np.square(one[dry])))))
        for e, one in pooled.items()
        if wet in one and dry in one
    }
    table = Table(title, header, tuple(rows))
    if not mean:
        return table, None
    error = max(mean, key=lambda e: mean[e][1] / mean[e][0])
    return table, (error, *mean[error])


def budgets(m: Material) -> Chapter | None:
    """Energy and fluid of each recording, by the thermobalance."""
    fitted, campaign = m.fitted[m.form.thermobalance], m.experiment.campaign
    outputs = [e for e in fitted.fit.problem.outputs if e in m.errors]
    found = {}
    for recording in campaign.recordings:
        run = predict_recording(fitted.model, campaign, recording, outputs, fitted.fit.noise.white)
        if (one := budget(run, campaign)) is not None:
            found[recording] = asdict(one) | {"gap": one.gap}
    if not found:
        return None
    names = list(found)
    wide = [names[k : k + _COLUMNS] for k in range(0, len(names), _COLUMNS)]
    tables = tuple(
        replace(table, title=f"{table.title}: {', '.join(part)}")
        for part in wide
        for table in budget_tables({name: found[name] for name in part})
    )
    gap = max(abs(one["gap"]) for one in found.values())
    largest = max(sum(abs(q) for q in one["entering"].values()) for one in found.values())
    return Chapter(
        "budgets",
        "Energy and fluid budget of each recording",
        "Section 6 announces a thermo-energetic model with all energy, fluidic and temperature flows; "
        "none is given.",
        tables,
        shows=(
            f"Heat that enters and is not stored is at most {gap:.2g} MJ in a recording (exchanged: up to "
            f"{largest:.3g} MJ). So the budgets close, and the integration is right.",
        ),
        not_shown=("Whether the machine had these heat flows: they are those of the fitted model.",),
    )
