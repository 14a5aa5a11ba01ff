"""Power off for 0.5, 4, 16 and 62 h: what a cold start, a frozen state and a fast-forward cost afterwards.

    python benchmarks/gaps.py

The virtual machine stops 24 h into a wet cycle and cools down; room and fluid go on. Compared with a runtime
that was never off.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.seal import open_seal
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import Recording, load_campaign
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.guards import Reading
from discovery.virtual.network import Inputs
from discovery.virtual.record import Order, take

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
TICK, OFF_AT = 60.0, 24 * 3600.0


def offsets(exported: Exported, inputs: np.ndarray, gap_s: float, how: str) -> np.ndarray:
    """Predicted errors after the gap; how: "always" on, or off and then "cold", "frozen" or "forward"."""
    compensator, found = Compensator(exported, Settings(tick_s=TICK)), []
    for k, row in enumerate(inputs):
        now = k * TICK
        if how != "always" and OFF_AT <= now < OFF_AT + gap_s:
            continue
        if now == OFF_AT + gap_s and how == "cold":
            compensator = Compensator(exported, Settings(tick_s=TICK))
        if now == OFF_AT + gap_s and how == "frozen" and compensator.origin is not None:
            compensator.origin += gap_s  # as if no time had gone by
        readings = {n: Reading(v, now) for n, v in zip(exported.compiled.inputs, row.tolist(), strict=True)}
        compensator.tick(readings, now)
        if now >= OFF_AT + gap_s:
            found.append(compensator.predicted)
    return np.array(found)


def power_cut(hours: float, inputs: Inputs) -> Inputs:
    """Drive and pump stand still for some hours."""
    off = (inputs["clock"] >= OFF_AT) & (inputs["clock"] < OFF_AT + hours * 3600.0)
    return {**inputs, **{name: np.where(off, 0.0, inputs[name]) for name in ("speed", "flow", "pump")}}


def main() -> None:
    """Print the largest difference from the runtime that was never off, over 24 h after the gap."""
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model
    exported = from_document(*open_seal(render(make_document(model, campaign, ["fit"])), "model"), "model")
    for hours in (0.5, 4.0, 16.0, 62.0):
        columns = take(Order("gap", "fit", 77, 48.0 + hours, change=partial(power_cut, hours))).columns
        values = {name: series for name, series in columns.items() if name != "time"}
        one = replace(campaign, recordings={"gap": Recording("gap", columns["time"], values)})
        inputs = sampled_inputs(one, "gap", exported.compiled.inputs, TICK)
        always = offsets(exported, inputs, hours * 3600.0, "always")
        worst = {
            how: float(np.max(np.abs(offsets(exported, inputs, hours * 3600.0, how) - always)))
            for how in ("cold", "frozen", "forward")
        }
        print(f"off for {hours:g} h: " + ", ".join(f"{how} {value:.1f} um" for how, value in worst.items()))


if __name__ == "__main__":
    main()
