"""The two demonstrations of what a model leaves out: what is named, rms of free runs on unseen recordings.

python benchmarks/repaired.py [demonstration] [tclab_mismatch]
"""

from __future__ import annotations

import json
import sys
import tempfile
import time as clock
from pathlib import Path

import numpy as np
import pandas as pd

from discovery.experiment import diagnose, load_experiment

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
GROUPS = {
    "demonstration": {"validation": ["validation"], "left_nozzle": ["left_nozzle"]},
    "tclab_mismatch": {
        "random both": ["random"],
        "steps up": ["step"],
        "heater 1, 0 to 100 %": ["step_h1_up_100"],
        "heater 2, 0 to 100 %": ["step_h2_up_100"],
    },
}


def show(name: str) -> None:
    """Diagnose an experiment in a folder that goes away; print what is named and the rms before and after."""
    experiment = load_experiment(EXPERIMENTS / f"{name}.toml")
    with tempfile.TemporaryDirectory() as place:
        began = clock.perf_counter()
        run = diagnose(EXPERIMENTS / f"{name}.toml", Path(place) / "run")
        print(f"{name}: {clock.perf_counter() - began:.0f} s")
        document = json.loads((run / "diagnosis.json").read_text(encoding="utf-8"))
        tables = {r: pd.read_csv(run / "predictions" / f"{r}.csv") for r in experiment.held_out}
    print(f"  {document['verdict']} {'; '.join(document['reasons'])}")
    for found in document["physics"]:
        sizes = ", ".join(
            f"{n} = {p['value']:.4g} ({p['low']:.4g} to {p['high']:.4g})"
            for n, p in found["parameters"].items()
        )
        print(f"  {found['effect']} at {', '.join(found['states'])}, {found['probability']:.2f}: {sizes}")
    models = [
        c.split("|")[1]
        for c in map(str, next(iter(tables.values())))
        if c.startswith(f"{experiment.outputs[0]}|")
    ]
    for group, words in GROUPS[name].items():
        chosen = [t for r, t in tables.items() if any(w in r for w in words)]
        for model in models:
            parts = [t[y] - t[f"{y}|{model}"] for t in chosen for y in experiment.outputs]
            rms = float(np.sqrt(np.mean([np.nanmean(part**2) for part in parts])))
            print(f"  {group:20s} {model:10s} {rms:7.2f}")


if __name__ == "__main__":
    for wanted in sys.argv[1:] or GROUPS:
        show(wanted)
