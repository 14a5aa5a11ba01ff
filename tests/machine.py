"""A three-body machine integrated by scipy, and the model of it that a diagnosis is given.

Nothing here touches discovery.dynamics: bodies, noise and what is concealed are written down anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.effects.candidates import candidates
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.scene import Scene
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, names, parse

Array = NDArray[np.float64]

BODIES = {"motor": 30e3, "table": 25e3, "bed": 120e3}  # J/K
SIZES = {"G_mt": 20.0, "G_tb": 12.0, "hA_m": 5.0, "hA_b": 9.0, "loss": 0.3, "hF": 30.0}
SEEN = {"E_Y": (1.9, 2.4, 3.1), "E_Z": (4.2, -1.5, 2.2), "E_R": (0.1, 4.0, 0.0)}  # um/K of motor, table, bed
NOISE = 0.4  # um
STEP, EVERY = 300.0, 900.0  # s, of inputs and of readings

CHANNELS = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "T_fluid": Channel("T_fluid", "fluid temperature", "degC", None, "linear"),
    "pump": Channel("pump", "fluid flow", "1", None, "held"),
    "speed": Channel("speed", "rotation speed", "rpm", None, "held"),
    "P_drive": Channel("P_drive", "heat load", "W", None, "held"),
    **{name: Channel(name, "error", "um", NOISE, "linear") for name in SEEN},
}

INPUTS = tuple(name for name, c in CHANNELS.items() if c.role != "error")
Inputs = Mapping[str, float]

# What is concealed: heat flows (3,) in W into the bodies, from time, bodies and inputs
Concealed = Callable[[float, Array, Inputs], Sequence[float]]


def model(wet: bool = True, linked: bool = True) -> Model:
    """The thermobalance as its author wrote it, sizes a little off; dry, or without the link to the bed."""
    terms = [
        Term("motor to table", "table", parse("G_mt*(motor - table)"), "motor"),
        Term("drive loss", "motor", parse("loss*P_drive")),
        Term("air at motor", "motor", parse("hA_m*(T_env - motor)")),
        Term("air at bed", "bed", parse("hA_b*(T_env - bed)")),
    ]
    if wet:
        terms.append(Term("fluid at table", "table", parse("hF*pump*(T_fluid - table)")))
    if linked:
        terms.append(Term("table to bed", "bed", parse("G_tb*(table - bed)"), "table"))
    used = {name for name in SIZES if any(name in names(t.expression) for t in terms)}
    units = {"loss": "1"}
    parameters = {
        name: Parameter(size * (1.15 if i % 2 else 0.9), units.get(name, "W/K"), 0.0)
        for i, (name, size) in enumerate(SIZES.items())
        if name in used
    }
    states = {name: State(name, "degC", c, parse("T_env"), 0.5, 1 / c) for name, c in BODIES.items()}
    outputs = {
        name: parse(" + ".join(f"({k})*({body} - 22)" for k, body in zip(row, BODIES, strict=True)))
        for name, row in SEEN.items()
    }
    return Model("three bodies", parameters, states, tuple(terms), outputs)


def simulated(
    seed: int,
    hours: float = 30.0,
    concealed: Concealed | None = None,
    noise: float = NOISE,
    slow: float = 0.0,
) -> Recording:
    """A recording with switching inputs; `slow`: first-order noise of 2 h, as a share of the white one."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, hours * 3600.0 + 1, STEP)
    phase = rng.uniform(0, 6, 2)

    def smooth(t: Array | float) -> tuple[Array | float, Array | float]:
        room = 22 + 1.5 * np.sin(t / 13751.0 + phase[0])
        return room, room + 2.0 + 1.5 * np.sin(t / 9000.0 + phase[1])

    blocks = np.maximum.accumulate(np.where(rng.random(len(time)) < 0.05, np.arange(len(time)), 0))
    speed = rng.choice([0.0, 300.0, 600.0, 1200.0], len(time))[blocks]
    drive = np.round(speed * rng.uniform(0.6, 1.0, len(time))[blocks])
    wet = np.maximum.accumulate(np.where(rng.random(len(time)) < 0.03, np.arange(len(time)), 0))
    pump = rng.choice([0.0, 1.0], len(time))[wet]
    x = _integrate(time, smooth, {"speed": speed, "P_drive": drive, "pump": pump}, concealed)
    room, fluid = smooth(time)
    values = {"T_env": room, "T_fluid": fluid, "pump": pump, "speed": speed, "P_drive": drive}
    read = np.isclose(time % EVERY, 0.0)
    for name, row in SEEN.items():
        error = (x - 22.0) @ np.array(row) + noise * (
            rng.standard_normal(len(time)) + slow * _slow(rng, len(time))
        )
        values[name] = np.where(read, error, np.nan)
    return Recording(f"r{seed}", time, {k: np.asarray(v, dtype=float) for k, v in values.items()})


def _integrate(
    time: Array,
    smooth: Callable[[float], tuple[Array | float, Array | float]],
    held: Mapping[str, Array],
    concealed: Concealed | None,
) -> Array:
    """Body temperatures (T, 3): one call of scipy between any two switches."""
    table = np.column_stack(list(held.values()))
    edges = np.unique([0, *(np.flatnonzero(np.any(np.diff(table, axis=0) != 0, axis=1)) + 1), len(time) - 1])
    capacity, p = np.array(list(BODIES.values())), SIZES
    x = np.empty((len(time), 3))
    x[0] = smooth(0.0)[0]
    for a, b in pairwise(edges):
        u = dict(zip(held, table[a], strict=True))

        def rate(t: float, y: Array, u: dict[str, float] = u) -> Array:
            room, fluid = smooth(t)
            motor, plate, bed = y
            q = np.array(
                [
                    p["G_mt"] * (plate - motor) + p["loss"] * u["P_drive"] + p["hA_m"] * (room - motor),
                    p["G_mt"] * (motor - plate)
                    + p["G_tb"] * (bed - plate)
                    + p["hF"] * u["pump"] * (fluid - plate),
                    p["G_tb"] * (plate - bed) + p["hA_b"] * (room - bed),
                ]
            )
            if concealed is not None:
                q = q + np.asarray(concealed(t, y, {**u, "T_env": float(room), "T_fluid": float(fluid)}))
            return np.asarray(q / capacity)

        span = time[a : b + 1]
        x[a : b + 1] = solve_ivp(
            rate, (span[0], span[-1]), x[a], t_eval=span, rtol=1e-7, atol=1e-7, max_step=1800
        ).y.T
    return x


def _slow(rng: np.random.Generator, count: int) -> Array:
    """First-order noise of unit variance, time constant two hours."""
    keep = np.exp(-STEP / 7200.0)
    out = np.empty(count)
    value = rng.standard_normal()
    for k in range(count):
        out[k] = value
        value = keep * value + np.sqrt(1 - keep**2) * rng.standard_normal()
    return out


def campaign(*recordings: Recording) -> Campaign:
    """The recordings as a campaign in memory."""
    return Campaign("three bodies", CHANNELS, {r.name: r for r in recordings})


def changed(recording: Recording, **values: Array) -> Recording:
    """The recording with other values of some channels."""
    return replace(recording, values={**recording.values, **values})


def scene(baseline: Model, recordings: Sequence[str] = ("r1", "r2")) -> Scene:
    """What candidates are made for on this machine, recordings in their order."""
    largest = {"T_env": 23.5, "T_fluid": 27.0, "pump": 1.0, "speed": 1200.0, "P_drive": 1200.0}
    after = {run: tuple(recordings[k:]) for k, run in enumerate(recordings)}
    unused = frozenset(set(largest) - set(baseline.inputs))
    return Scene(CHANNELS, tuple(SEEN), tuple(recordings), after, largest, unused, 0.02, 0.02)


def claims(baseline: Model, *words: str, recordings: Sequence[str] = ("r1", "r2")) -> list[Hypothesis]:
    """Effects at all their places, at their middle shape values."""
    return candidates(baseline, [catalogue()[word] for word in words], scene(baseline, recordings))
