"""The next experiment: which pattern of inputs would separate two models, and how long it takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from discovery.design.patterns import patterns
from discovery.design.separation import separation
from discovery.diagnosis.context import Context
from discovery.diagnosis.thresholds import BELIEF
from discovery.dynamics import Trajectory, make_system, simulate, start_values
from discovery.dynamics.grid import Grid
from discovery.dynamics.samples import Samples
from discovery.errors import RunsAwayError
from discovery.fitting import Noise
from discovery.models import Model
from discovery.printed import lasting
from discovery.terms import Name

Array = NDArray[np.float64]

DECISIVE = 3.0  # log evidence that settles a question
LONGEST = 12 * 3600.0  # s, a shift on a machine tool; less where recordings are shorter
STEPS, READINGS = 720, 72  # of inputs and readings in a pattern
HOPELESS = 16  # times the pattern would have to be repeated


@dataclass(frozen=True)
class Aim:
    """What an experiment is for: what a pattern does, and what it is that differs at a body."""

    does: str
    differ: str


def believed(context: Context) -> dict[str, float]:
    """How far the baseline's own parameters may be off: a recording that they explain proves no effect."""
    fitted = context.baseline.model.parameters
    return {
        name: BELIEF * max(abs(fitted[name].value), abs(context.model.parameters[name].value))
        for name in context.model.free
    }


def next_experiment(
    context: Context,
    answer: Model,
    other: Model,
    noise: Noise,
    purpose: Aim,
    known: Mapping[str, float] | None = None,
) -> str:
    """A sentence: the inputs that separate two models best, how soon, and the best new sensor.

    Args:
        other: a rival, or, for a confirmation, the answer without its effects: the refitted baseline is bent
            to stand in for them, and would differ most where they do not act.
        known: parameters that the recording would determine anew, with the size of their errors.
    """
    length = min(LONGEST, max(float(g.time[-1] - g.time[0]) for g in context.grids.values()))
    results: list[tuple[Array, str, Trajectory, Trajectory]] = []
    time = np.linspace(0.0, length, STEPS + 1)
    wanted = patterns(context, time)
    for text, inputs in wanted.items():
        try:
            a, b = (_run(context, model, inputs, time) for model in (answer, other))
        except RunsAwayError:
            continue
        results.append((separation(a, b, noise, known), text, a, b))
    if not results:
        return "record the machine longer, with every input moving on its own"
    gained, text, a, b = max(results, key=lambda r: float(r[0][-1]))
    read = _read(context)
    shared = [
        s
        for s in a.system.states
        if s in b.system.states and s not in read and not a.system.model.states[s].memory
    ]
    spread = {
        s: float(np.sqrt(np.mean((a.x[:, a.system.states.index(s)] - b.x[:, b.system.states.index(s)]) ** 2)))
        for s in shared
    }
    sensor = max(spread, key=lambda s: spread[s]) if spread else None
    every = length / READINGS
    times = ceil(DECISIVE / max(float(gained[-1]), 1e-9))
    if times > HOPELESS:
        tried = f"{len(wanted)} input patterns of {lasting(length)}"
        sentence = f"none of {tried} {purpose.does} with these outputs alone"
    elif times > 1:
        often = f"{times} recordings of {lasting(length)}, readings every {lasting(every)}"
        sentence = f"{text}: {purpose.does} with {often}"
    else:
        instants = a.system.grid.time[a.system.grid.read]
        soon = max(float(instants[np.argmax(gained >= DECISIVE)]), every)
        sentence = f"{text}: {purpose.does} within about {lasting(soon)} of readings every {lasting(every)}"
    if sensor and spread[sensor] > 0.02:
        apart = f"{purpose.differ} by {spread[sensor]:.2f} K rms"
        sentence += f"; a temperature sensor on {sensor} helps most ({apart})"
    return sentence


def _read(context: Context) -> set[str]:
    """States that a measured output shows directly: they have their sensor."""
    shown = {n: context.model.outputs.get(n, Name(n)) for n in context.outputs}
    return {y.id for y in shown.values() if isinstance(y, Name)}


def _run(context: Context, model: Model, inputs: Mapping[str, Array], time: Array) -> Trajectory:
    """Return a run of a model under a pattern of inputs. It starts as the first recording did."""
    samples = {
        n: Samples(time, v, context.campaign.channels[n].between == "linear") for n, v in inputs.items()
    }
    read = np.arange(0, STEPS + 1, STEPS // READINGS)
    readings = np.full((len(read), len(context.outputs)), np.nan)
    begun = make_system(model, context.grids[context.recordings[0]])
    readings[0] = [next((v for v in column if np.isfinite(v)), np.nan) for column in begun.grid.readings.T]
    grid = Grid("next experiment", time, samples, context.outputs, read, readings)
    values = model.values(grid.recording)
    return simulate(make_system(model, grid), values, start_values(begun, values))
