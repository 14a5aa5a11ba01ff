"""The next experiment: which pattern of inputs would separate two models, and how long it takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from discovery.design.separation import separation
from discovery.diagnosis.context import Context
from discovery.diagnosis.thresholds import BELIEF
from discovery.dynamics import Trajectory, make_system, simulate
from discovery.dynamics.grid import Grid
from discovery.dynamics.samples import Samples
from discovery.errors import RunsAwayError
from discovery.fitting import Noise
from discovery.models import Model
from discovery.models.units import same_dimension
from discovery.printed import lasting
from discovery.recordings import Channel
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
    for text, inputs in _designs(context, length).items():
        try:
            a, b = _run(context, answer, inputs, length), _run(context, other, inputs, length)
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
        sentence = f"no input pattern of {lasting(length)} {purpose.does} with these outputs alone"
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


def _designs(context: Context, length: float) -> dict[str, Mapping[str, Array]]:
    """Patterns in words, each input at the instants of the pattern: of what this machine has to be moved."""
    time = np.linspace(0.0, length, STEPS + 1)
    channels = context.campaign.channels
    series = {
        n: np.concatenate([context.grids[r].samples[n].value for r in context.recordings])
        for n in context.grids[context.recordings[0]].samples
    }
    roles = {n: channels[n].role for n in series}
    wet = {"fluid flow", "fluid temperature"} <= set(roles.values())  # else what flows is a coolant

    def build(speed: Array, load: Array, pump: Array, warm: bool) -> dict[str, Array]:
        share = {
            "rotation speed": speed,
            "heat load": load,
            "cooling power": load,
            "fluid flow": pump if wet else np.ones(len(time)),
            "fluid temperature": np.ones(len(time)) if warm else None,
        }
        out = {}
        for n, role in roles.items():
            moved = share.get(role)
            level = np.quantile(series[n], 0.95) if moved is not None else np.median(series[n])
            out[n] = level * (np.ones(len(time)) if moved is None else moved)
        return out

    zero, one, first = np.zeros(len(time)), np.ones(len(time)), (time < length / 2).astype(float)
    sixth, twelfth = (((time // (length / n)) % 2 == 0).astype(float) for n in (6, 12))
    speed, load = (r in roles.values() for r in ("rotation speed", "heat load"))

    def called(role: str, word: str) -> str:
        """The only channel of a role by its name, several by a word."""
        mine = [n for n, one in roles.items() if one == role]
        return mine[0] if len(mine) == 1 else word

    names = called("rotation speed", "speed"), called("heat load", "load")
    moving = " and ".join(name for name, there in zip(names, (speed, load), strict=True) if there)
    dry, still = ", dry" if wet else "", "stand still" if speed else "leave everything off"
    half, two, hour = (lasting(length / n) for n in (2, 6, 12))
    wanted: dict[str, Mapping[str, Array]] = {}
    if wet:
        wanted[f"switch the pump every {two} at standstill with warm fluid"] = build(zero, zero, sixth, True)
    if wet and moving:
        wanted[f"switch the pump every {two} at full {moving}"] = build(one, one, sixth, False)
        wanted[f"step {moving} every {hour} with the pump running"] = build(twelfth, twelfth, one, False)
    if moving:
        wanted[f"run {half} at full {moving}{dry}, then {still} for {half}"] = build(
            first, first, zero, False
        )
        wanted[f"step {moving} every {hour}{dry}"] = build(twelfth, twelfth, zero, False)
    if speed and load:
        wanted[f"run at half {names[0]} and full {names[1]}{dry}"] = build(0.5 * one, one, zero, False)
    wanted[f"{still} and follow the room"] = build(zero, zero, zero, False)
    stepped = ("other input",) if wet else ("other input", "fluid flow")  # a coolant never stays off
    for n in (n for n, role in roles.items() if role in stepped and _is_set(channels[n])):
        low, high = np.quantile(series[n], (0.05, 0.95))
        if high > low:
            wanted[f"step {n} every {hour}{dry}"] = {
                **build(zero, zero, zero, False),
                n: low + (high - low) * twelfth,
            }
    return wanted


def _is_set(channel: Channel) -> bool:
    """Whether somebody sets an input: it stays until it is set anew. What moves in between, as a temperature,
    is only measured, and nobody steps the sun.
    """
    return channel.between == "held" and not same_dimension(channel.unit, "W/m**2")


def _run(context: Context, model: Model, inputs: Mapping[str, Array], length: float) -> Trajectory:
    """Return a run of a model under a pattern of inputs. It starts as the first recording did."""
    time = np.linspace(0.0, length, STEPS + 1)
    samples = {
        n: Samples(time, v, context.campaign.channels[n].between == "linear") for n, v in inputs.items()
    }
    read = np.arange(0, STEPS + 1, STEPS // READINGS)
    readings = np.full((len(read), len(context.outputs)), np.nan)
    known = context.grids[context.recordings[0]].readings
    readings[0] = [next((v for v in column if np.isfinite(v)), np.nan) for column in known.T]
    grid = Grid("next experiment", time, samples, context.outputs, read, readings)
    return simulate(make_system(model, grid), model.values(grid.recording))
