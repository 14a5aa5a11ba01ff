"""The effects that can be switched on: the words of the catalogue, what a size means, where each acts.

A request is written `radiation=0.5`, `fluid_convection@b_body_1=15` or, for an effect between two bodies,
`flooded_gap@c_body_1+b_body_1=40`. Zero size is the plain plant.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UsageError
from discovery.virtual.machine import BODIES

Array = NDArray[np.float64]


class Effect(NamedTuple):
    """One row of the table: unit and realistic range of the size, default place, and the law in one line."""

    unit: str
    low: float
    high: float
    at: tuple[str, ...]
    law: str


MOST = 10.0  # times the largest realistic size: what the plant still computes
WET = ("table", "c_body_1")
EFFECTS: dict[str, Effect] = {
    # cutting fluid
    "fluid_convection": Effect("W/K", 5, 30, ("b_body_1",), "q = size pump (T_fluid - T)"),
    "fluid_convection_flow": Effect(
        "1", 0.2, 0.5, ("table", "c_body_1"), "G_wet ~ flow^(1 - size); shows with --cycle flow"
    ),
    "fluid_convection_speed": Effect(
        "W/K", 5, 40, ("c_body_1",), "q = size pump (n/600)^(2/3) (T_fluid - T)"
    ),
    "rim_detachment": Effect("1", 0.3, 1.0, ("c_body_1",), "G_wet (1 - size + size/(1 + (n/200)^2))"),
    "evaporation_drying": Effect(
        "W", 15, 120, ("table",), "q = -size wetness (c_sat(T) - 0.45 c_sat(T_env))/c_0"
    ),
    "film_drag": Effect("W", 20, 80, ("table",), "q = size pump (n/600)^2, and as much into the sump"),
    "flooded_gap": Effect("W/K", 10, 45, ("c_body_1", "b_body_1"), "q = size pump (T_1 - T_2)"),
    "fluid_delay": Effect("s", 300, 1800, WET, "the fluid arrives as it was size seconds ago"),
    "fluid_sump": Effect("K", 1, 4, WET, "nozzle warmer than the sensor: d' = (size pump - d)/3.7 h"),
    "swarf_heat": Effect("W", 100, 400, ("table",), "pulses of 5 to 40 min while the pump runs"),
    # drive and cooling
    "friction_speed": Effect("W", 20, 80, ("c_body_1",), "q = size (n/600)^(5/3), not in the recorded power"),
    "viscosity_temperature": Effect(
        "W", 40, 250, ("c_body_1",), "q = size (n/600)^(5/3) (exp(-0.03 (T - 22)) - 1)"
    ),
    "thermal_preload": Effect("1/K", 0.01, 0.08, ("c_body_1",), "q = size M_c w (T - T_b_body_1)"),
    "copper_resistance": Effect("1", 0.5, 2.0, ("c_body_2",), "q = size 0.00393 (T - 22) P_copper"),
    "windage": Effect("W", 1, 4, ("table",), "q = size (n/600)^2.8"),
    "cooling_hysteresis": Effect(
        "K", 0.5, 2.0, ("c_body_2",), "coolant swings by +-size, on/off chiller of 2 kW"
    ),
    "wear": Effect(
        "1", 0.1, 0.4, ("c_body_1",), "friction heat falls by size from one recording to the next"
    ),
    # air and structure
    "rotating_air_convection": Effect("W/K", 2, 12, ("table",), "q = size (n/600)^0.8 (T_env - T)"),
    "natural_convection": Effect("W/K", 2, 12, ("b_body_1",), "q = size (|dT|/5)^(1/4) dT, dT = T_env - T"),
    "radiation": Effect(
        "m2", 0.2, 1.5, ("b_body_1",), "q = size sigma (T_env^4 - T^4), size = emissivity x area"
    ),
    "air_convection": Effect("W/K", 2, 10, ("b_body_1",), "q = size (T_env - T)"),
    "conduction_path": Effect("W/K", 3, 20, ("table", "b_body_1"), "q = size (T_1 - T_2)"),
    "second_thermal_mass": Effect(
        "W/K", 8, 40, ("b_body_1",), "a hidden mass of 3200 s hangs on the body by size"
    ),
    "bed_memory": Effect(
        "W/K", 3, 15, ("b_body_1",), "q = size (T_bed - T), the bed follows the room in 30 h"
    ),
    "joint_hysteresis": Effect(
        "K", 0.2, 0.8, ("b_body_1",), "the body's growth shows only beyond a play of +-size"
    ),
    "contact_conductance": Effect(
        "1/K", 0.03, 0.12, ("c_body_1", "b_body_1"), "G (1 + size ((T_1 + T_2)/2 - 22))"
    ),
    "unmeasured_heat": Effect("W", 40, 200, ("b_body_1",), "a constant heat for 3 to 10 h"),
}
PAIRS = ("flooded_gap", "conduction_path", "contact_conductance")


class Sizes(NamedTuple):
    """Size of each effect by body, shape (5,), or by pair of bodies, shape (5, 5): what the kernel reads."""

    fluid_convection: Array
    fluid_convection_flow: Array
    fluid_convection_speed: Array
    rim_detachment: Array
    evaporation_drying: Array
    film_drag: Array
    flooded_gap: Array
    fluid_delay: Array
    fluid_sump: Array
    swarf_heat: Array
    friction_speed: Array
    viscosity_temperature: Array
    thermal_preload: Array
    copper_resistance: Array
    windage: Array
    cooling_hysteresis: Array
    wear: Array
    rotating_air_convection: Array
    natural_convection: Array
    radiation: Array
    air_convection: Array
    conduction_path: Array
    second_thermal_mass: Array
    bed_memory: Array
    joint_hysteresis: Array
    contact_conductance: Array
    unmeasured_heat: Array


class Request(NamedTuple):
    """An effect asked for: its name, its size, the bodies where it acts."""

    effect: str
    size: float
    states: tuple[str, ...]


def parse_request(text: str) -> Request:
    """Read `name[@body[+body]]=size`.

    Raises UsageError: an unknown name or body, a size that is no number or far from any machine.
    """
    head, equals, size_text = text.partition("=")
    name, at, places = head.strip().partition("@")
    if name not in EFFECTS:
        raise UsageError(f"There is no effect '{name}' in '{text}'; choose one of: {', '.join(EFFECTS)}.")
    try:
        size = float(size_text)
    except ValueError:
        size = float("nan")
    if not equals or not np.isfinite(size):
        unit, example = EFFECTS[name].unit, EFFECTS[name].low
        raise UsageError(f"The effect '{text}' needs a size in {unit}, for example {name}={example:g}.")
    if not 0.0 <= size <= MOST * EFFECTS[name].high:
        unit, low, high = EFFECTS[name][:3]
        usual = f"usual is {low:g} to {high:g} {unit}"
        raise UsageError(f"The size in '{text}' is not possible; give 0 to {MOST * high:g} ({usual}).")
    states = tuple(places.split("+")) if at else EFFECTS[name].at
    unknown = [state for state in states if state not in BODIES]
    if unknown:
        raise UsageError(f"There is no body '{unknown[0]}' in '{text}'; choose from: {', '.join(BODIES)}.")
    if name in PAIRS and len(set(states)) != 2:
        raise UsageError(f"'{text}' acts between two bodies; write {name}@c_body_1+b_body_1={size:g}.")
    return Request(name, size, states)


def sizes(requests: list[Request] | tuple[Request, ...] = ()) -> Sizes:
    """The sizes that the kernel reads, from a list of requests; none: the plain plant."""
    table = {name: np.zeros((5, 5) if name in PAIRS else 5) for name in EFFECTS}
    for request in requests:
        places = [BODIES.index(state) for state in request.states]
        if request.effect in PAIRS:
            table[request.effect][places[0], places[1]] += request.size
        else:
            table[request.effect][places] += request.size
    return Sizes(**table)
