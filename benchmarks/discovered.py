"""The discovered models of the two experiments against eq. (9) and the hand-built ones, on recordings held
out.

python benchmarks/discovered.py [nmv5000] [tclab]
"""

from __future__ import annotations

import sys
import time as clock
from pathlib import Path

import numpy as np

from discovery.dynamics import predict
from discovery.fitting import fit_model, predict_recording
from discovery.fitting.starts import warm_start
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.models.reduced import reduced
from discovery.recordings import Campaign, load_campaign
from discovery.sparse.discover import discover
from discovery.sparse.options import SparseOptions

DATA = Path(__file__).parents[1] / "datasets"
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")


def left(model: Model, campaign: Campaign, recording: str, outputs: tuple[str, ...]) -> np.ndarray:  # type: ignore[type-arg]
    """Readings minus free run (R, Y)."""
    trajectory = predict_recording(model, campaign, recording, outputs)
    return np.asarray(trajectory.system.grid.readings - predict(trajectory))


def nmv5000() -> None:
    """Rms on recordings that nothing was fitted to."""
    campaign = load_campaign(DATA / "nmv5000" / "campaign.toml")
    fit = ("fit",)
    eq9 = warm_start(
        reduced(("T_env", "P_drive", "T_fluid"), ERRORS, campaign.channels), campaign, fit, ERRORS
    )
    models = {"eq. (9)": fit_model(eq9, campaign, fit, ERRORS).model}
    for name, options in {
        "discovered on the dry thermobalance": SparseOptions(baseline="dry_thermobalance.toml"),
        "discovered, hidden masses alone": SparseOptions(),
    }.items():
        began = clock.perf_counter()
        found = discover(campaign, fit, ERRORS, options)
        models[name] = found.model
        print(f"{name}: {clock.perf_counter() - began:.1f} s")
        print("   ", found.report["groups"][0].get("kept", [g["terms"] for g in found.report["groups"]]))
    hand = read_model(DATA / "nmv5000" / "thermobalance.toml")
    models["hand-built thermobalance"] = fit_model(hand, campaign, fit, ERRORS).model
    for recording in ("validation", "left_nozzle", "height_100"):
        print(f"{recording:12s}" + "".join(f"{e:>8s}" for e in ERRORS))
        for name, model in models.items():
            rms = np.sqrt(np.nanmean(left(model, campaign, recording, ERRORS) ** 2, axis=0))
            print(f"    {name:38s}" + "".join(f"{value:8.2f}" for value in rms))


def tclab() -> None:
    """Rms over both sensors on random runs and steps that nothing was fitted to."""
    import tomllib

    campaign = load_campaign(DATA / "tclab" / "campaign.toml")
    experiment = tomllib.loads((DATA.parent / "experiments" / "tclab.toml").read_text(encoding="utf-8"))
    outputs = ("T1", "T2")
    began = clock.perf_counter()
    found = discover(campaign, experiment["fit"], outputs, SparseOptions())
    print(f"discovered: {clock.perf_counter() - began:.1f} s")
    print("   ", found.report["groups"][0]["kept"])
    naive = fit_model(
        read_model(DATA.parent / "experiments" / "tclab_first_order.toml"),
        campaign,
        experiment["fit"],
        outputs,
    ).model
    for kind in ("random", "step"):
        for scope, names in (
            ("held out", [r for r in experiment["held_out"] if kind in r]),
            (
                "every run not fitted",
                [r for r in campaign.recordings if kind in r and r not in experiment["fit"]],
            ),
        ):
            row = []
            for model in (naive, found.model):
                squares = [
                    np.nanmean(left(model, campaign, r, outputs) ** 2) for r in names if "down" not in r
                ]
                row.append(np.sqrt(np.mean(squares)))
            print(f"{kind:7s} {scope:22s} first order {row[0]:6.2f} K, discovered {row[1]:6.2f} K")


if __name__ == "__main__":
    for name in sys.argv[1:] or ("nmv5000", "tclab"):
        {"nmv5000": nmv5000, "tclab": tclab}[name]()
