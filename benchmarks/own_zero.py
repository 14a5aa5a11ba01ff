"""Whether `discovery new` gives recordings a zero of their own where they have one, and only there.

    python -m benchmarks.own_zero SEED SEED ... [--start cold warm]

Machines and recordings are those of `benchmarks.zeros`. Each is given to the first hour twice: counted from
one true zero, and counted from the first reading of each recording. A line has the rms that the best of two
quick kinds of models leaves on recordings left out of its fit, with an own zero over without; whether
`discovery new` keeps the own zero; and the same quotient on two recordings that nothing has seen.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.zeros import FIT, HELD_OUT, STARTS, campaigns, held_out
from discovery.experiment import load_experiment
from discovery.experiment.modelfits import fit_of
from discovery.files import format_toml
from discovery.firsthour.choosing import CANDIDATES, choose
from discovery.firsthour.firstmodel import usual_inputs
from discovery.firsthour.guess import Guess
from discovery.firsthour.inputs import strongest
from discovery.firsthour.new import GOOD, KEPT
from discovery.firsthour.recorded import recorded
from discovery.firsthour.table import read_tables
from discovery.firsthour.texts import experiment_text
from discovery.firsthour.zeros import perhaps_own_zeros
from discovery.recordings import Campaign, load_campaign

KINDS = ("regression", "reduced")


def written(folder: Path, campaign: Campaign, spreads: Mapping[str, float]) -> Path:
    """Files of a campaign, its errors with these spreads, and an experiment of two quick kinds of models."""
    for name, one in campaign.recordings.items():
        rows = zip(one.time, *one.values.values(), strict=True)
        lines = [",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in rows]
        (folder / f"{name}.csv").write_text("\n".join([",".join(["time", *one.values]), *lines]) + "\n")
    channels = {
        c.name: {"role": c.role, "unit": c.unit, "between": c.between}
        | ({"spread": spreads[c.name]} if c.name in spreads else {})
        for c in campaign.channels.values()
    }
    files = {name: {"file": f"{name}.csv"} for name in campaign.recordings}
    form = {"name": "own zero", "channels": channels, "recordings": files}
    (folder / "campaign.toml").write_text(format_toml(form))
    guesses = {c.name: Guess(c.role, c.unit, "") for c in campaign.channels.values()}
    outputs = [c.name for c in campaign.channels.values() if c.role == "error"]
    room = next(c.name for c in campaign.channels.values() if c.role == "ambient temperature")
    inputs = strongest(campaign, FIT, outputs, usual_inputs(guesses, room))
    listed = ", ".join(f'"{name}"' for name in inputs)
    models = {kind: CANDIDATES[kind].replace("INPUTS", listed) for kind in KINDS}
    text = experiment_text("own zero", [*FIT, HELD_OUT[0]], outputs, models, None, ())
    (folder / "experiment.toml").write_text(text)
    return folder / "experiment.toml"


def judged(campaign: Campaign, spreads: Mapping[str, float]) -> tuple[float, float]:
    """Of the best kind: the share of the rms without a model that stays on recordings left out of its fit,
    and the rms on recordings that nothing has seen.
    """
    with tempfile.TemporaryDirectory() as name:
        experiment = load_experiment(written(Path(name), campaign, spreads))
        whole = load_campaign(Path(name))
    best = choose(experiment)[0]
    fit = fit_of(experiment, best.name, experiment.form.models[best.name])[2]
    return best.ratio, held_out(fit, whole)


def offered(campaign: Campaign) -> dict[str, float]:
    """Errors for which the first hour tries an own zero, with the spread."""
    guesses = {c.name: Guess(c.role, c.unit, "") for c in campaign.channels.values()}
    with tempfile.TemporaryDirectory() as name:
        written(Path(name), campaign, {})
        tables = [table for run in (*FIT, HELD_OUT[0]) for table in read_tables(Path(name) / f"{run}.csv")]
    return perhaps_own_zeros(recorded(tables, None), guesses, {})


def main() -> None:
    """Try, print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--start", nargs="+", choices=STARTS, default=STARTS)
    arguments = parser.parse_args()
    print(
        "| machine | zero of the recordings | left out, with / without | kept | never seen, with / without |"
    )
    print("| --- | --- | ---: | --- | ---: |")
    for seed in arguments.seeds:
        for start in arguments.start:
            of_way, _ = campaigns(seed, start)
            for way, zero in (("true zero", "one"), ("first reading", "each its own")):
                campaign = of_way[way]
                if not (spreads := offered(campaign)):
                    print(f"| {campaign.name} | {zero} | - | not tried | - |", flush=True)
                    continue
                without, own = judged(campaign, {}), judged(campaign, spreads)
                kept = own[0] < KEPT * without[0] and without[0] > GOOD
                cells = f"{own[0] / without[0]:.2f} | {'yes' if kept else 'no'} | {own[1] / without[1]:.2f}"
                print(f"| {campaign.name} | {zero} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
