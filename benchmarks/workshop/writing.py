"""Write a case: recordings as a logger writes them, campaign, model and experiment."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .case import AMBIENT, OUTPUTS, THERMOMETERS, Case, Channel, Machine, Signals
from .network import STEP, Array
from .signals import lagged

Off = Mapping[str, tuple[float, float]]
"""By channel what its sensor is off by: a share, and a constant in the unit of the channel."""


def seed_of(name: str) -> int:
    """The seed of a case is fixed by its name: the same case has the same bytes everywhere."""
    return zlib.crc32(name.encode()) % 100000


def sensors(name: str, machine: Machine) -> Off:
    """The sensors of a case are the same in all its recordings."""
    rng = np.random.default_rng([seed_of(name), 99])
    return {c: (rng.normal() * how.gain, rng.normal() * how.zero) for c, how in machine.channels.items()}


def simulated(name: str, case: Case, place: int, *, complete: bool = True) -> Signals:
    """True values of a recording in steps of 5 s; if not `complete`, without what the model lacks."""
    machine = case.machine
    count = int(machine.hours[place] * 3600 / STEP)
    acting = case.knows | case.lacks if complete else case.knows
    rng = np.random.default_rng([seed_of(name), place])
    return case.simulate(rng, count, machine.runs[place], acting)


def reading(rng: np.random.Generator, how: Channel, off: tuple[float, float], true: Array) -> Array:
    """What a sensor that is `off` shows of true values, with noise and resolution."""
    gain, zero = off
    shown = true + (true - 22.0) * gain if how.role in THERMOMETERS else true * (1 + gain)
    shown = shown + zero + how.noise * rng.normal(size=len(shown))
    shown = shown * (1 + how.relative * rng.normal(size=len(shown)))
    return np.asarray(np.round(shown / how.step) * how.step if how.step else shown)


def logged(name: str, case: Case, place: int, true: Signals) -> Signals:
    """Columns of a recording: `time` [s] from 0, and each channel in its unit."""
    machine, rng = case.machine, np.random.default_rng([seed_of(name), place, 7])
    count, stride = len(next(iter(true.values()))), int(machine.every / STEP)
    at, off = np.arange(stride, count, stride), sensors(name, machine)
    table: Signals = {"time": np.asarray((at - stride) * STEP, dtype=float)}
    for channel, how in machine.channels.items():
        series = lagged(true[channel], how.lag) if how.lag else true[channel]
        age = 0 if how.role in OUTPUTS else int(machine.late * machine.every / STEP)
        table[channel] = reading(rng, how, off[channel], series[np.maximum(at - age, 0)])
    return table


def visible(name: str, case: Case) -> dict[str, float]:
    """By output, its change by what the model lacks, in reading noises (rms, mean of the recordings)."""
    if case.key["effect"] is None:
        return {}
    machine, sizes = case.machine, {}
    pairs = [
        (simulated(name, case, k), simulated(name, case, k, complete=False)) for k in range(len(machine.runs))
    ]
    for output in machine.outputs:
        how = machine.channels[output]
        changes = [np.sqrt(np.mean((full[output] - less[output]) ** 2)) for full, less in pairs]
        sizes[output] = round(float(np.mean(changes)) / max(how.noise, 0.29 * how.step), 1)
    return sizes


def csv(table: Signals) -> str:
    """The text of a recording: times in whole seconds, readings with six digits."""
    lines = [",".join(table)]
    for time, *values in zip(*table.values(), strict=True):
        lines.append(",".join([f"{time:.0f}", *(f"{value:.6g}" for value in values)]))
    return "\n".join(lines) + "\n"


def campaign_text(name: str, machine: Machine) -> str:
    """The campaign: channels and recordings."""
    channels = "".join(
        f'{c} = {{ role = "{how.role}", unit = "{how.unit}" }}\n' for c, how in machine.channels.items()
    )
    runs = "".join(f'{run} = {{ file = "{run}.csv" }}\n' for run in machine.runs)
    return f'name = "{name}"\n[channels]\n{channels}[recordings]\n{runs}'


def shows_more(machine: Machine) -> bool:
    """Whether an output is more than a state that is read."""
    return any(output != law for output, law in machine.outputs.items())


def model_text(name: str, machine: Machine) -> str:
    """The hand-built model."""
    room = next(c for c, how in machine.channels.items() if how.role == AMBIENT)
    states = "".join(
        f'{s} = {{ unit = "degC", capacity = {capacity}'
        + ("" if s in machine.channels else f', start = "{room}"')
        + " }\n"
        for s, capacity in machine.states.items()
    )
    terms = "".join(
        f'[[terms]]\ninto = "{into}"\n'
        + (f'from = "{source}"\n' if source else "")
        + f'expression = "{law}"\n'
        for into, source, law in machine.terms
    )
    outputs = "".join(f'{output} = "{law}"\n' for output, law in machine.outputs.items())
    shown = f"[outputs]\n{outputs}" if shows_more(machine) else ""
    return f'name = "{name}"\n[parameters]\n{machine.parameters}[states]\n{states}{terms}{shown}'


def experiment_text(name: str, machine: Machine) -> str:
    """The experiment: the last recording is held out."""
    *fit, held_out = machine.runs
    outputs = f"outputs = {json.dumps([*machine.outputs])}\n" if shows_more(machine) else ""
    return (
        f'name = "{name}"\ncampaign = "campaign.toml"\nfit = {json.dumps(fit)}\nheld_out = ["{held_out}"]\n'
        f'{outputs}[models]\nmine = {{ file = "model.toml" }}\n[mismatch]\nmodel = "mine"\n'
    )


def write_case(folder: Path, name: str, case: Case) -> dict[str, Any]:
    """Write a case into its folder. Returns its key, and the `offsets` that correct its sensors."""
    machine = case.machine
    folder.mkdir(parents=True, exist_ok=True)
    for place, run in enumerate(machine.runs):
        table = logged(name, case, place, simulated(name, case, place))
        (folder / f"{run}.csv").write_text(csv(table), "utf-8")
    (folder / "campaign.toml").write_text(campaign_text(name, machine), "utf-8")
    (folder / "model.toml").write_text(model_text(name.rsplit("_", 1)[0], machine), "utf-8")
    (folder / "experiment.toml").write_text(experiment_text(name, machine), "utf-8")
    off = sensors(name, machine)
    offsets = {c: round(-off[c][1], 3) for c, how in machine.channels.items() if how.zero}
    return {**case.key, "offsets": offsets, "changes_noises": visible(name, case)}
