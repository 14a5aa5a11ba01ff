"""Thirty days of an ageing virtual machine: losses fall, a gap widens; the error left with and without
updating.

    python benchmarks/ageing.py [days] [seed]

Every day is a random cycle of 24 h. An update sees six readings of a day (one about every four hours); the
error is judged on all the other readings of the *next* day, which no update has seen yet.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from discovery.runtime.belief import belief_of, residual_levels, update_belief

from discovery.dynamics.system import predict as model_outputs
from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal
from discovery.fitting import fit_model, predict_recording
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.recordings import Campaign, Recording, load_campaign
from discovery.runtime.update import next_revision
from discovery.virtual.machine import Machine
from discovery.virtual.record import Order, take

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")


def aged(day: int) -> Machine:
    """Losses that reach the bodies fall by 1 % a day, the gap between C-Body 1 and B-Body 1 conducts 1.5 %
    more.
    """
    fresh = Machine()
    loss = 1.0 - 0.01 * day
    return fresh._replace(
        friction_share=tuple(loss * share for share in fresh.friction_share),
        motor_share=tuple(loss * share for share in fresh.motor_share),
        G_c1_b1=fresh.G_c1_b1 * (1.0 + 0.015 * day),
    )


def day_of(campaign: Campaign, day: int, machine: Machine, seed: int, few: bool) -> Campaign:
    """A day on the machine; `few`: only six of its readings."""
    columns = take(Order(f"day_{day}", "fit", seed + day, 24.0, machine=machine)).columns
    values = {name: series for name, series in columns.items() if name != "time"}
    read = np.flatnonzero(np.isfinite(values[ERRORS[0]]))
    if few:
        chosen = np.concatenate([read[:1], read[len(read) // 6 :: len(read) // 6]])[:6]
        for name in ERRORS:
            values[name] = np.where(np.isin(np.arange(len(columns["time"])), chosen), values[name], np.nan)
    recording = Recording(f"day_{day}", columns["time"], values)
    return replace(campaign, recordings={recording.name: recording})


def error_left(model: Model, campaign: Campaign, name: str) -> float:
    """rms over all errors of a free run, E_A0C weighed as um at 0.35 m."""
    trajectory = predict_recording(model, campaign, name, ERRORS)
    residual = trajectory.system.grid.readings - model_outputs(trajectory)
    residual[:, 3] *= 0.35
    return float(np.sqrt(np.nanmean(residual[1:] ** 2)))


def sealed(document: Mapping[str, Any]) -> Exported:
    """The model of a document, as a runtime reads it."""
    return from_document(*open_seal(render(document), "model"), "model")


def main(days: int, seed: int) -> None:
    """Print the error left day by day."""
    began = time.perf_counter()
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model
    exported = sealed(make_document(model, campaign, ["fit"]))
    belief, levels = belief_of(exported), residual_levels(exported)
    rows = []
    for day in range(1, days + 1):
        whole = day_of(campaign, day, aged(day - 1), seed, few=False)
        name = f"day_{day}"
        fresh = day_of(campaign, day, aged(0), seed, few=False)
        rows.append(
            (
                error_left(belief.at_work, whole, name),
                error_left(model, whole, name),
                error_left(model, fresh, name),
            )
        )
        belief, finding = update_belief(
            belief, levels, day_of(campaign, day, aged(day - 1), seed, few=True), name
        )
        if finding.verdict == "drift":
            exported = sealed(next_revision(exported, belief, [finding]))
            belief = belief_of(exported)
        updated, left, fresh_left = rows[-1]
        print(
            f"day {day:2d}: left {updated:.2f} with updating, {left:.2f} without, {fresh_left:.2f} had it "
            "not aged; "
            f"{finding.verdict}, p = {finding.p_value:.2g}"
        )
    found = np.array(rows)
    last = found[-7:]
    print(
        f"day one {found[0, 0]:.2f} um; last seven days: with updating {last[:, 0].mean():.2f} um "
        f"({last[:, 0].mean() / found[0, 0]:.2f} of day one), without {last[:, 1].mean():.2f} um "
        f"({last[:, 1].mean() / found[0, 0]:.2f}), had it not aged {last[:, 2].mean():.2f} um; "
        f"worst day with updating {found[:, 0].max():.2f} um"
    )
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main(*(int(word) for word in (sys.argv[1:] + ["30", "1000"][len(sys.argv) - 1 :])))
