"""The main job on campaigns that nobody has looked at: new cycles, new noise, another machine on request.

    python benchmarks/fresh_campaigns.py SEED SEED ... [--spread 0.2] [--models reduced black_box]

The campaign that comes along, and some defaults of the search, were chosen while its held-out figures were in
view. Here everything random is drawn anew by the seed: cycles, room, noise, random heat; with `--spread` also
every conductance, loss, share and film of the plant, each by its own factor (capacities and levers stay: the
models have them from the drawing). The models are those of `experiments/nmv5000.toml`, as they stand there.
Seeds 1 to 16 were looked at while this was written.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from discovery.evaluation.paper import TABLE_3
from discovery.experiment import Experiment, load_experiment
from discovery.experiment.fitted import predict
from discovery.experiment.modelfits import fit_of
from discovery.recordings import load_campaign
from discovery.virtual.machine import Machine
from discovery.virtual.network import Law
from discovery.virtual.nmv5000.campaign import ORDERS
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import write_campaign

EXPERIMENT = Path(__file__).parents[1] / "experiments" / "nmv5000.toml"
EQUATIONS = {"reduced": "9", "superposition": "8", "one_at_a_time": "8"}
DISCOVERED = ("discovered", "black_box")
MODELS = (*EQUATIONS, *DISCOVERED)
HELD_OUT = ("validation", "left_nozzle")
CRITERIA = ("peak", "mean", "variance")
STREAMS = ("supply", "return")  # what the pump moves goes round
Scores = Mapping[str, Mapping[str, Mapping[str, Any]]]  # recording -> error -> what results.json says


def machine(seed: int, spread: float) -> Machine:
    """The plant with each group of laws (air, losses, films, joints, ...) times its own factor between
    1 - spread and 1 + spread.
    """
    rng, fresh = np.random.default_rng([seed, 20]), five_axis()
    factors = {
        name: rng.uniform(1.0 - spread, 1.0 + spread)
        for name in dict.fromkeys(law.name for law in fresh.network.laws if law.name not in STREAMS)
    }

    def drawn(law: Law) -> Law:
        return replace(law, size=law.size * factors.get(law.name, 1.0))

    return replace(fresh, network=fresh.network.changed(drawn))


def campaign(experiment: Experiment, seed: int, spread: float, folder: Path) -> Experiment:
    """The experiment on a campaign recorded for it, through its files."""
    plant = machine(seed, spread)
    needed = (*experiment.fit, *HELD_OUT, "only_environment", "only_fluid", "warm_up")
    orders = [replace(o, seed=100 * seed + o.seed, machine=plant) for o in ORDERS if o.name in needed]
    write_campaign(folder, f"seed {seed}", orders)
    return replace(experiment, campaign=load_campaign(folder))


def scores(experiment: Experiment, name: str) -> Scores:
    """Free runs on the held-out recordings of a model fitted to the others."""
    entry = experiment.form.models[name]
    experiment = experiment.seen_by(entry)
    fit = fit_of(experiment, name, entry)[2]
    return {recording: predict(fit, experiment, recording).scores() for recording in HELD_OUT}


def figures(values: Sequence[float], digits: int) -> str:
    """Numbers of the errors, in the order of the experiment."""
    return ", ".join(f"{value:.{digits}f}" for value in values)


def of_errors(found: Scores, recording: str, *keys: str) -> list[float]:
    """One number for each error: found[recording][error][keys]."""
    entries: list[Any] = list(found[recording].values())
    for key in keys:
        entries = [entry[key] for entry in entries]
    return entries


def print_rms(seed: int, found: Mapping[str, Scores]) -> None:
    """Rows of rms, um (um/m), by recording."""
    for name in found:
        cells = [figures(of_errors(found[name], recording, "rms"), 2) for recording in HELD_OUT]
        print(f"| {seed} | {name} | {' | '.join(cells)} |")
    print(end="", flush=True)


def ratio(found: Mapping[str, Scores], name: str, recording: str) -> list[float]:
    """rms of a model as a share of that of eq. (9), by error."""
    ours, its = (of_errors(found[model], recording, "rms") for model in (name, "reduced"))
    return [a / b for a, b in zip(ours, its, strict=True)]


def print_summary(errors: Sequence[str], all_found: Sequence[Mapping[str, Scores]]) -> None:
    """Over all seeds: the ratio, and improvements next to the paper's, which are printed in whole percent."""
    fitted = list(all_found[0])
    for name in [name for name in DISCOVERED if name in fitted]:
        for recording in HELD_OUT:
            every = np.array([ratio(found, name, recording) for found in all_found])
            middle, worst = figures(np.median(every, axis=0), 2), figures(every.max(axis=0), 2)
            better = int((every <= 1.0).all(axis=1).sum())
            print(
                f"{name} / eq. (9), {recording}: median {middle}; largest {worst}; no worse in any error on "
                f"{better} of {len(every)}"
            )
    print(f"| model | criterion | recording | median % of {', '.join(errors)} | least | reached the paper |")
    for name, equation in [pair for pair in EQUATIONS.items() if pair[0] in fitted]:
        for k, key in enumerate(CRITERIA):
            paper = np.array([TABLE_3[error][f"{equation} %"][k] for error in errors])
            for recording in HELD_OUT:
                ours = np.array(
                    [of_errors(found[name], recording, "improvement", key) for found in all_found]
                )
                reached = (np.round(ours) >= paper).sum(axis=0)
                print(
                    f"| {name} | {key} | {recording} | {figures(np.median(ours, axis=0), 1)} "
                    f"| {figures(ours.min(axis=0), 1)} | {figures(reached, 0)} of {len(ours)} |"
                )


def main() -> None:
    """Record, fit, print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--spread", type=float, default=0.0, help="of the plant's numbers, e.g. 0.2")
    parser.add_argument("--models", nargs="+", choices=MODELS, default=MODELS, help="among them reduced")
    arguments = parser.parse_args()
    experiment = load_experiment(EXPERIMENT)
    outputs = ", ".join(experiment.outputs)
    print(f"| seed | model | {' | '.join(f'{recording}, rms of {outputs}' for recording in HELD_OUT)} |")
    everything = []
    for seed in arguments.seeds:
        with tempfile.TemporaryDirectory() as folder:
            fresh = campaign(experiment, seed, arguments.spread, Path(folder))
        everything.append({name: scores(fresh, name) for name in arguments.models})
        print_rms(seed, everything[-1])
    print_summary(experiment.outputs, everything)


if __name__ == "__main__":
    main()
