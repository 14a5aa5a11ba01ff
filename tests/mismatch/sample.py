"""A sample machine with every kind of place where an effect can act, and two short recordings of it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, names, parse

Array = NDArray[np.float64]

CHANNELS = {
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "emulsion": Channel("emulsion", "fluid temperature", "degC", None, "linear"),
    "water": Channel("water", "coolant temperature", "degC", None, "linear"),
    "pump": Channel("pump", "fluid flow", "1", None, "held"),
    "rpm": Channel("rpm", "rotation speed", "rpm", None, "held"),
    "drive": Channel("drive", "heat load", "W", None, "held"),
    "chiller": Channel("chiller", "cooling power", "W", None, "held"),
    "cut": Channel("cut", "other input", "W", None, "held"),
    "E_Y": Channel("E_Y", "error", "um", 0.5, "linear"),
    "E_Z": Channel("E_Z", "error", "um", 0.5, "linear"),
}
STATES = {"motor": 30e3, "table": 25e3, "bed": 120e3}
TERMS = (
    Term("motor to table", "table", parse("G_mt*(motor - table)"), "motor"),
    Term("drive", "motor", parse("loss*drive")),
    Term("chiller", "motor", parse("-cold*chiller")),
    Term("air", "bed", parse("hA*(room - bed)")),
    Term("bearing", "table", parse("P_b*(rpm/1000)**1.5")),
    Term("fluid", "table", parse("hF*pump*(emulsion - table)")),
)
UNITS = {"G_mt": "W/K", "loss": "1", "cold": "1", "P_b": "W", "hA": "W/K", "hF": "W/K"}
RUNS = ("one", "two")


def sample(without: Collection[str] = ()) -> tuple[Model, dict[str, Channel]]:
    """Three bodies with every kind of place, or what is left of them without channels of some roles."""
    channels = {name: c for name, c in CHANNELS.items() if c.role not in without}
    known = set(channels) | set(STATES) | set(UNITS)
    terms = tuple(t for t in TERMS if names(t.expression) <= known)
    states = {name: State(name, "degC", c, parse("22"), 0.5, 1 / c) for name, c in STATES.items()}
    parameters = {name: Parameter(0.3 if unit == "1" else 8.0, unit, 0.0) for name, unit in UNITS.items()}
    return Model(
        "sample", parameters, states, terms, {"E_Y": parse("2.0*table + 1.5*bed"), "E_Z": parse("3.0*motor")}
    ), channels


def campaign() -> Campaign:
    """Two recordings of three hours in which every input moves."""
    recordings = {}
    for k, run in enumerate(RUNS):
        rng, time = np.random.default_rng(k), np.arange(0.0, 10801.0, 60.0)
        walk = {
            name: 22 + np.cumsum(rng.normal(0, 0.09, len(time))) for name in ("room", "emulsion", "water")
        }
        high = {"pump": 4.0, "rpm": 1000.0, "drive": 500.0, "chiller": 300.0, "cut": 2000.0}
        switched = {
            name: size * np.repeat(rng.choice([0.0, 0.5, 1.0], 19), 10)[: len(time)]
            for name, size in high.items()
        }
        read = {name: np.where(np.arange(len(time)) % 10 == 0, 0.0, np.nan) for name in ("E_Y", "E_Z")}
        recordings[run] = Recording(run, time, {**walk, **switched, **read})
    return Campaign("sample", CHANNELS, recordings)


def expand(effect: Effect, without: Collection[str] = ()) -> list[Hypothesis]:
    """Every place and shape of an effect on the sample machine."""
    model, channels = sample(without)
    return hypotheses(model, channels, ("E_Y", "E_Z"), RUNS, [effect])


def trajectory(model: Model, recording: str = "two") -> Trajectory:
    """Free run of a model of the sample machine."""
    inputs = [n for n in CHANNELS if not n.startswith("E_")]
    grid = make_grid(campaign(), recording, inputs, ("E_Y", "E_Z"))
    return simulate(make_system(model, grid), model.values(recording))


def inside(h: Hypothesis) -> Hypothesis:
    """The hypothesis with instants that lie within the recordings."""
    instants = {"t_on": 2000.0, "t_off": 7000.0, "t_step": 4000.0, "t_zero": 4000.0, "t_first": 4200.0}
    return h.at({n: v for n in h.shapes for short, v in instants.items() if n.startswith(short)})
