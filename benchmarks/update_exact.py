"""`discovery update` on a machine whose laws are those of the model: python -m benchmarks.update_exact

The five changes of an outside review, three recordings of 72 h each, with all readings and with eight a day.
A line for each: what was done, the verdict, the log odds of each hypothesis against no change, and the name.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.ageing import ERRORS, recorded, sealed
from discovery.diagnosis.context import make_scene
from discovery.dynamics import predict
from discovery.effects.candidates import candidates
from discovery.effects.catalogue import catalogue
from discovery.fitting import fit_model, predict_recording
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.recordings import Campaign, load_campaign
from discovery.runtime.hypotheses import compare
from discovery.runtime.update import Update

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
NOISE = {"E_Y0C": 0.4, "E_Z0T": 0.4, "E_R0T": 0.4, "E_A0C": 1.0}  # um, um/m


def read_with(model: Model, campaign: Campaign, seed: int, readings: int | None = None) -> Campaign:
    """The recordings of a campaign with what a model and noise make of the errors; `readings`: so many of
    each recording, None: all.
    """
    rng, found = np.random.default_rng(seed), {}
    for name, recording in campaign.recordings.items():
        run = predict_recording(model, campaign, name, ERRORS)
        grid, values = run.system.grid, dict(recording.values)
        shown = predict(run)
        at = np.searchsorted(recording.time, grid.time[grid.read])
        kept = np.arange(len(at)) if readings is None else np.linspace(0, len(at) - 1, readings).astype(int)
        for y, error in enumerate(ERRORS):
            column = np.full(len(recording.time), np.nan)
            column[at[kept]] = shown[kept, y] + rng.normal(0.0, NOISE[error], len(kept))
            values[error] = column
        found[name] = replace(recording, values=values)
    return replace(campaign, recordings=found)


def grown(
    model: Model, campaign: Campaign, word: str, places: set[str], size: float, width: float | None = None
) -> Model:
    """The model with an effect of the catalogue of a size; `width`: of its play."""
    scene = make_scene(campaign, model, tuple(campaign.recordings), ERRORS, {})
    lasting = [e for e in catalogue().values() if e.acts == "always"]
    h = next(
        h
        for h in candidates(model, lasting, scene)
        if h.effect.word == word and {*h.states, *h.outputs} == places
    )
    shaped = h if width is None else h.at(dict.fromkeys(h.shapes, width))
    return shaped.added_to(model, dict.fromkeys(h.amplitudes, size))


def main() -> None:
    """Fit the thermobalance to recordings of itself, then compare recordings of it with each change."""
    machine = load_campaign(DATA / "campaign.toml", only=["fit"])
    start = read_model(DATA / "thermobalance.toml")
    truth = fit_model(start, machine, ["fit"]).model
    seen = read_with(truth, machine, 1)
    exported = sealed(fit_model(start, seen, ["fit"]).model, seen)
    inputs = recorded(machine, 3, 72.0, 10000)
    values = truth.values()

    def times(factor: float, first: str) -> Model:
        return truth.with_values({n: factor * v for n, v in values.items() if n.startswith(first)})

    changed = {
        "nothing": truth,
        "flooded gap 25 W/K": grown(truth, inputs, "flooded_gap", {"c_body_1", "b_body_1"}, 25.0),
        "fan, air +6 W/K at b_body_1": grown(truth, inputs, "air_convection", {"b_body_1"}, 6.0),
        "fan, all air +60 %": times(1.6, "hA_"),
        "hysteresis of a joint, 1.5 um": grown(truth, inputs, "joint_hysteresis", {"E_Y0C"}, 1.0, 1.5),
        "wear, losses -10 %": times(0.9, "loss_"),
        "room sensor +1.5 K": truth,
    }
    for readings in (None, 24):
        for title, model in changed.items():
            these = read_with(model, inputs, 2, readings)
            if title.startswith("room"):
                off = {n: {**r.values, "T_env": r.values["T_env"] + 1.5} for n, r in these.recordings.items()}
                these = replace(
                    these, recordings={n: replace(r, values=off[n]) for n, r in these.recordings.items()}
                )
            given = "all readings" if readings is None else f"{readings // 3} readings a day"
            found = compare(exported, these, list(these.recordings))
            named = Update(found).lines()[1:2] if found.verdict == "new physics" else []
            print(f"{title}, {given}: {found}", *named, sep="\n    ", flush=True)


if __name__ == "__main__":
    main()
