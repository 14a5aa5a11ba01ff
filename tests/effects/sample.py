"""A sample machine with every kind of place where an effect can act, as a balance of heat and as a model of
its errors; two short recordings of it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.effects.candidates import candidates, with_shapes
from discovery.effects.catalogue import Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.scene import Scene
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
    "spray": Channel("spray", "fluid flow", "l/min", None, "held"),
    "side": Channel("side", "nozzle side", "1", None, "held"),
    "rack": Channel("rack", "temperature", "degC", None, "linear"),
    "servo": Channel("servo", "other input", "A", None, "held"),
    "E_Y": Channel("E_Y", "error", "um", 0.5, "linear"),
    "E_Z": Channel("E_Z", "error", "um", 0.5, "linear"),
    "T_motor": Channel("T_motor", "temperature", "degC", 0.1, "linear"),
}
STATES = {"motor": 30e3, "table": 25e3, "bed": 120e3}
TERMS = (
    Term("motor to table", "table", parse("G_mt*(motor - table)"), "motor"),
    Term("drive", "motor", parse("loss*drive")),
    Term("chiller", "motor", parse("-cold*chiller")),
    Term("air", "bed", parse("hA*(room - bed)")),
    Term("bearing", "table", parse("P_b*(rpm/1000)**1.5")),
    Term("fluid", "table", parse("hF*pump*(emulsion - table)")),
    Term("winding", "motor", parse("R_w*servo**2")),
    Term("water", "bed", parse("h_w*(water - bed)")),
)
UNITS = {
    "G_mt": "W/K",
    "loss": "1",
    "cold": "1",
    "P_b": "W",
    "hA": "W/K",
    "hF": "W/K",
    "R_w": "W/A**2",
    "h_w": "W/K",
}
RUNS = ("one", "two")
READ = ("E_Y", "E_Z", "T_motor")
HIGH = {
    "pump": 4.0,
    "rpm": 1000.0,
    "drive": 500.0,
    "chiller": 300.0,
    "cut": 2000.0,
    "spray": 9.0,
    "side": 1.0,
    "servo": 5.0,
}
OF_ERRORS = ("error state", "output of errors")  # places of models whose states are the errors
EVERY, LONG = 600.0, 10800.0  # s, between readings and of a recording
ODDS, EVENT_ODDS = 0.1, 0.05


def sample(without: Collection[str] = ()) -> tuple[Model, dict[str, Channel]]:
    """Three bodies with every kind of place, or what is left of them without channels of some roles."""
    channels = {name: c for name, c in CHANNELS.items() if c.role not in without}
    known = set(channels) | set(STATES) | set(UNITS)
    terms = tuple(t for t in TERMS if names(t.expression) <= known)
    states = {name: State(name, "degC", c, parse("22"), 0.5, 1 / c) for name, c in STATES.items()}
    parameters = {name: Parameter(0.3 if unit == "1" else 8.0, unit, 0.0) for name, unit in UNITS.items()}
    return Model(
        "sample",
        parameters,
        states,
        terms,
        {"E_Y": parse("2.0*table + 1.5*bed"), "E_Z": parse("3.0*motor"), "T_motor": parse("1.0*motor")},
    ), channels


def campaign() -> Campaign:
    """Two recordings of three hours in which every input moves."""
    recordings = {}
    for k, run in enumerate(RUNS):
        rng, time = np.random.default_rng(k), np.arange(0.0, LONG + 1, 60.0)
        walk = {
            name: 22 + np.cumsum(rng.normal(0, 0.09, len(time)))
            for name in ("room", "emulsion", "water", "rack")
        }
        switched = {
            name: size * np.repeat(rng.choice([0.0, 0.5, 1.0], 19), 10)[: len(time)]
            for name, size in HIGH.items()
        }
        read = {name: np.where(time % EVERY == 0, 0.0, np.nan) for name in READ}
        recordings[run] = Recording(run, time, {**walk, **switched, **read})
    return Campaign("sample", CHANNELS, recordings)


def errors() -> Model:
    """Two errors that follow what drives them."""
    states = {name: State(name, "um", None, parse("0"), 0.0, 1 / 3600) for name in ("E_Y", "E_Z")}
    terms = tuple(
        Term(f"{kind} {name}", name, parse(text))
        for name in states
        for kind, text in (
            ("back", f"-r_{name}*{name}"),
            ("drive", f"k_{name}*drive"),
            ("fluid", f"f_{name}*pump*(emulsion - room)"),
        )
    )
    sizes = {"r": (0.8, "1/h"), "k": (0.02, "um/h/W"), "f": (1.5, "um/h/K")}
    parameters = {
        f"{short}_{name}": Parameter(value, unit, 0.0)
        for short, (value, unit) in sizes.items()
        for name in states
    }
    return Model("errors", parameters, states, terms, {}, "h")


def scene(
    model: Model, channels: Mapping[str, Channel], odds: float = ODDS, runs: tuple[str, ...] = RUNS
) -> Scene:
    """What candidates are made for: every input moves."""
    largest = {name: HIGH.get(name, 25.0) for name in channels if name not in READ}
    after = {run: runs[k:] for k, run in enumerate(runs)}
    unused = frozenset(set(largest) - set(model.inputs))
    shown = tuple(name for name in READ if name in {*model.outputs, *model.states})
    return Scene(channels, shown, runs, after, largest, unused, odds, EVENT_ODDS)


def claims(model: Model, effect: Effect, channels: Mapping[str, Channel] = CHANNELS) -> list[Hypothesis]:
    """An effect at every place of a model, at every shape value that a search tries."""
    effect = replace(effect, shapes=tuple(s.within(0.5 * EVERY, LONG) for s in effect.shapes))
    seen = scene(model, channels)
    return [one for h in candidates(model, [effect], seen) for one in with_shapes(h)]


def machine_for(effect: Effect) -> Model:
    """The sample machine in the form in which an effect can act on it."""
    return errors() if effect.place in OF_ERRORS else sample()[0]


def expand(effect: Effect, without: Collection[str] = ()) -> list[Hypothesis]:
    """Every place and shape of an effect on the sample machine, without what would make it needless."""
    model, channels = sample({*without, *effect.unless})
    return claims(errors() if effect.place in OF_ERRORS else model, effect, channels)


def trajectory(model: Model, recording: str = "two", still: bool = False) -> Trajectory:
    """Free run of a model of the sample machine; `still`: no input moves."""
    inputs = [n for n in CHANNELS if n not in READ]
    recorded = campaign()
    if still:
        one = recorded.recordings[recording]
        values = {name: np.full(len(one.time), one.values[name][0]) for name in inputs}
        held = replace(one, values={**one.values, **values})
        recorded = replace(recorded, recordings={recording: held})
    shown = tuple(name for name in READ if name in {*model.outputs, *model.states})
    grid = make_grid(recorded, recording, inputs, shown)
    return simulate(make_system(model, grid), model.values(recording))


def inside(h: Hypothesis) -> Hypothesis:
    """The hypothesis with instants that lie within the recordings."""
    instants = {"t_on": 2000.0, "t_off": 7000.0, "t_in": 4000.0}
    instants |= {"t_step": 4000.0, "t_zero": 4000.0, "t_first": 4200.0}
    return h.at({n: v for n in h.shapes for short, v in instants.items() if n.startswith(short)})
