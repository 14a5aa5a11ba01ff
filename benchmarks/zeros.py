"""What a zero of its own in each recording costs or gains every kind of model, on drawn machines.

    python -m benchmarks.zeros SEED SEED ... [--start cold warm] [--models regression reduced ...]

Each seed draws a machine of the next family, three recordings of 24 h to fit and two held out. They all begin
cold (at rest for 30 h) or all warm (at work for 30 h). All readings count from the first one of their
recording, because no zero is known. Models are fitted in three ways: to these readings; with a zero of its
own in each recording; and, to compare with, to readings from the true zero. A line for each case has the rms
of held-out free runs in um, pooled over the errors, of each way. At the end stands the mean of the logarithm
of own zero over first reading, by kind of model and start, with its standard error over the machines.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from discovery.dynamics import predict
from discovery.errors import RunsAwayError
from discovery.firsthour.firstmodel import first_model, usual_inputs
from discovery.firsthour.guess import Guess
from discovery.firsthour.inputs import strongest
from discovery.fitting import Fit, fit_model, predict_recording
from discovery.fitting.ridge import fit_ridge
from discovery.fitting.starts import warm_start
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.models.reduced import reduced
from discovery.models.superposition import superposition
from discovery.recordings import Campaign, Channel, Recording
from discovery.recordings.roles import ROLES, Between
from discovery.sparse.discover import discover, fitting
from discovery.sparse.options import SparseOptions
from discovery.sparse.plain import fit_plain, settings
from discovery.virtual.families import FAMILIES
from discovery.virtual.log import Chain, Columns, observe, reading_instants
from discovery.virtual.machine import Machine
from discovery.virtual.network import Array, heat
from discovery.virtual.signals import HOUR, Draw, noise
from discovery.virtual.simulate import simulate

FIT, HELD_OUT = ("a", "b", "c"), ("d", "e")
HOURS, READ_S, NOISE = 24.0, 600.0, 0.4  # of a recording; between readings; um, of a reading
WAYS = ("first reading", "own zero", "true zero")
STARTS = ("cold", "warm")


def recorded(rng: Draw, machine: Machine, start: str) -> Columns:
    """A log of the machine; it rests or works before it begins."""
    pace = machine.pace
    u = dict(machine.cycle(rng, HOURS + pace.before_h))
    n, first = len(next(iter(u.values()))), round(pace.before_h * HOUR / pace.step_s)
    for name in machine.work if start == "cold" else ():
        u[name] = np.where(np.arange(n) < first, 0.0, u[name])
    u["clock"] = np.asarray((np.arange(n) - first + 0.5) * pace.step_s)
    u |= {"number": np.zeros(n), "age": np.zeros(n)}
    small = {f"unrecorded {b}": noise(rng, n, pace.step_s, HOUR, pace.heat_w) for b in machine.bodies}
    run = simulate(machine.network, u | small, pace.step_s, float(u[machine.words.air][0]))
    at = reading_instants(rng, replace(pace, hours=HOURS), (READ_S, READ_S))
    return observe(machine, run, first, at, rng, Chain(NOISE))


def campaigns(seed: int, start: str) -> tuple[dict[str, Campaign], Model]:
    """The same readings by way, and the baseline of the machine as its author knows it."""
    rng = np.random.default_rng([seed, STARTS.index(start)])
    family = list(FAMILIES)[seed % len(FAMILIES)]
    machine = FAMILIES[family](rng)
    machine = machine.plus(
        [
            heat("unrecorded", node, share, f"unrecorded {body}")
            for body, bar in machine.bodies.items()
            for node, share in bar.span()
        ]
    )
    logs = {name: recorded(rng, machine, start) for name in (*FIT, *HELD_OUT)}
    inputs = {c.name: c for c in machine.channels if c.series is not None}
    errors = [c for c in machine.channels if c.series is None and c.role == "error"]
    moved = {
        c.name: np.concatenate([_from_first(logs[r][c.name]) for r in FIT]) for c in errors
    }  # as `discovery new` has the spread
    spread = {name: float(np.sqrt(np.nanmean(values**2))) for name, values in moved.items()}

    def made(way: str) -> Campaign:
        counted = way != "true zero"
        recordings = {
            name: Recording(
                name,
                log["time"],
                {u: log[u] for u in inputs}
                | {c.name: _from_first(log[c.name]) if counted else log[c.name] for c in errors},
            )
            for name, log in logs.items()
        }
        channels = {c.name: Channel(c.name, c.role, c.unit, None, _between(c.role)) for c in inputs.values()}
        for c in errors:
            own = spread[c.name] if way == "own zero" else 0.0
            channels[c.name] = Channel(c.name, "error", c.unit, None, "linear", own)
        return Campaign(f"{family} {seed} {start}", channels, recordings)

    return {way: made(way) for way in WAYS}, machine.baseline.with_values(machine.nominal)


def _from_first(values: Array) -> Array:
    known = values[np.isfinite(values)]
    return np.asarray(values - known[0])


def _between(role: str) -> Between:
    return ROLES[role].between


def kinds(campaign: Campaign, baseline: Model) -> dict[str, Callable[[Campaign], Fit]]:
    """How each kind of model is fitted, as an experiment of `discovery new` does it."""
    outputs = [name for name, c in campaign.channels.items() if c.role == "error"]
    every = [name for name, c in campaign.channels.items() if c.is_input]
    guesses = {name: Guess(c.role, c.unit, "") for name, c in campaign.channels.items()}
    inputs = strongest(campaign, FIT, outputs, usual_inputs(guesses, "T_env"))

    def built(build: Callable[..., Model], c: Campaign) -> Fit:
        return fit_model(warm_start(build(inputs, outputs, c.channels), c, FIT, outputs), c, FIT, outputs)

    def masses(c: Campaign) -> Fit:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.toml"
            path.write_text(first_model(guesses, outputs, "T_env", inputs, masses=2))
            return fit_model(read_model(path), c, FIT, outputs)

    def found(c: Campaign) -> Fit:
        one = discover(c, FIT, outputs, SparseOptions(kind="sindy", bootstraps=0))
        return fitting(one.report)(one.model, c, FIT, outputs)

    return {
        "regression": lambda c: fit_ridge(c, FIT, outputs, every),
        "reduced": partial(built, reduced),
        "superposition": partial(built, superposition),
        "two masses": masses,
        "baseline": lambda c: fit_model(baseline, c, FIT, outputs),
        "pysindy": lambda c: fit_plain(c, FIT, outputs, every, settings())[0],
        "discovered": found,
    }


def held_out(fit: Fit, campaign: Campaign) -> float:
    """Rms of free runs on the held-out recordings, pooled over the errors."""
    left = []
    for name in HELD_OUT:
        try:
            run = predict_recording(
                fit.model, campaign, name, fit.problem.outputs, fit.noise.white, zeros=fit.zeros
            )
            left.append((run.system.grid.readings - predict(run)).ravel())
        except RunsAwayError:
            return np.inf
    return float(np.sqrt(np.nanmean(np.concatenate(left) ** 2)))


def main() -> None:
    """Record, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--start", nargs="+", choices=STARTS, default=STARTS)
    parser.add_argument("--models", nargs="+", default=None)
    arguments = parser.parse_args()
    print(f"| machine | model | {' | '.join(WAYS)} |\n| --- | --- |{' ---: |' * len(WAYS)}")
    gains: dict[tuple[str, str], list[float]] = {}
    for seed in arguments.seeds:
        for start in arguments.start:
            of_way, baseline = campaigns(seed, start)
            for kind, fitted in kinds(of_way["first reading"], baseline).items():
                if arguments.models and kind not in arguments.models:
                    continue
                rms = {way: held_out(fitted(c), c) for way, c in of_way.items()}
                cells = " | ".join(f"{value:.2f}" for value in rms.values())
                print(f"| {of_way[WAYS[0]].name} | {kind} | {cells} |", flush=True)
                gains.setdefault((kind, start), []).append(float(np.log(rms[WAYS[1]] / rms[WAYS[0]])))
    print("\n| model | start | own zero over first reading | machines |\n| --- | --- | ---: | ---: |")
    for (kind, start), logs in gains.items():
        error = np.std(logs, ddof=1) / np.sqrt(len(logs)) if len(logs) > 1 else np.nan
        low, middle, high = np.exp(np.mean(logs) + np.array([-error, 0.0, error]))
        print(f"| {kind} | {start} | {middle:.2f} ({low:.2f} to {high:.2f}) | {len(logs)} |")


if __name__ == "__main__":
    main()
