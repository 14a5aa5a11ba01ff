"""The next experiment: which recording would tell the rivals apart, and how long it has to be."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, make_system, simulate
from discovery.dynamics.grid import Grid, Samples
from discovery.dynamics.system import predict
from discovery.errors import UserError
from discovery.mismatch.context import Context
from discovery.models import Model

Array = NDArray[np.float64]

DECISIVE = 3.0  # log evidence that settles a question
HOURS = 12.0
READ_EVERY = 600.0  # s


def next_experiment(context: Context, answer: Model, rival: Model | None, white: Array) -> str:
    """A sentence: the inputs that separate two fitted models most, for how long, and the best new sensor.

    Without a rival the answer is compared with the refitted baseline, as a confirmation.
    """
    other = rival or context.baseline.model
    results: list[tuple[float, str, Trajectory, Trajectory]] = []
    for text, samples in _designs(context).items():
        try:
            a, b = _run(context, answer, samples), _run(context, other, samples)
        except UserError:
            continue
        separation = 0.5 * float(np.sum(((predict(a) - predict(b)) / white) ** 2))
        results.append((separation, text, a, b))
    if not results:
        return "record the machine longer, with every input moving on its own"
    separation, text, a, b = max(results, key=lambda r: r[0])
    hours = HOURS * DECISIVE / max(separation, 1e-9)
    shared = [
        s
        for s in a.system.states
        if s in b.system.states and s not in a.system.grid.outputs and not s.startswith("lag_")
    ]
    spread = {
        s: float(np.sqrt(np.mean((a.x[:, a.system.states.index(s)] - b.x[:, b.system.states.index(s)]) ** 2)))
        for s in shared
    }
    sensor = max(spread, key=lambda s: spread[s]) if spread else None
    purpose = "tells the rivals apart" if rival else "would confirm the answer"
    if hours > 200:
        sentence = f"no input pattern of {HOURS:.0f} h {purpose} with the errors alone"
    else:
        sentence = (
            f"{text}: {purpose} within about {max(hours, READ_EVERY / 3600):.1f} h of readings every 10 min"
        )
    if sensor and spread[sensor] > 0.02:
        apart = f"the two answers differ there by {spread[sensor]:.2f} K rms"
        sentence += f"; a temperature sensor on {sensor} helps most ({apart})"
    return sentence


def _designs(context: Context) -> dict[str, Mapping[str, Array]]:
    """Patterns of 12 h in words, with each input on a grid of minutes."""
    time = np.arange(0.0, HOURS * 3600 + 1, 60.0)
    channels = context.campaign.channels
    known = context.grids[context.recordings[0]].samples
    middle = {
        n: float(np.median(np.concatenate([context.grids[r].samples[n].value for r in context.recordings])))
        for n in known
    }
    high = {
        n: float(
            np.quantile(np.concatenate([context.grids[r].samples[n].value for r in context.recordings]), 0.95)
        )
        for n in known
    }
    roles = {n: channels[n].role for n in known}
    on = ((time // 7200) % 2 == 0).astype(float)
    quick = ((time // 3600) % 2 == 0).astype(float)

    def build(speed: Array, load: Array, pump: Array, warm: bool) -> dict[str, Array]:
        out = {}
        for n, role in roles.items():
            level = np.full(len(time), middle[n])
            if role == "rotation speed":
                level = speed * high[n]
            elif role in ("heat load", "cooling power"):
                level = load * high[n]
            elif role == "fluid flow":
                level = pump * high[n]
            elif role == "fluid temperature" and warm:
                level = np.full(len(time), high[n])
            out[n] = level
        return out

    zero, one, first = np.zeros(len(time)), np.ones(len(time)), (time < HOURS * 1800).astype(float)
    wanted: dict[str, dict[str, Array]] = {}
    if any(r == "fluid flow" for r in roles.values()):
        wanted["switch the pump every 2 h at standstill with warm fluid"] = build(zero, zero, on, True)
        wanted["switch the pump every 2 h at full speed"] = build(one, one, on, False)
        wanted["step the speed every hour with the pump running"] = build(quick, quick, one, False)
    if any(r in ("rotation speed", "heat load") for r in roles.values()):
        wanted["run 6 h at full load dry, then stand still for 6 h"] = build(first, first, zero, False)
        wanted["step speed and load every hour, dry"] = build(quick, quick, zero, False)
        wanted["run at half speed and full load, dry"] = build(0.5 * one, one, zero, False)
    wanted["stand still and let the machine follow the room"] = build(zero, zero, zero, False)
    return dict(wanted)


def _run(context: Context, model: Model, inputs: Mapping[str, Array]) -> Trajectory:
    time = np.arange(0.0, HOURS * 3600 + 1, 60.0)
    samples = {
        n: Samples(time, v, context.campaign.channels[n].between == "linear") for n, v in inputs.items()
    }
    read = np.arange(0, len(time), int(READ_EVERY // 60))
    grid = Grid(
        "design", time, samples, context.outputs, read, np.full((len(read), len(context.outputs)), np.nan)
    )
    system = make_system(model, grid)
    return simulate(system, model.values("design"))
