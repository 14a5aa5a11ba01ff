"""Sizes that key and diagnosis measure alike: amplitude of the diagnosis in the unit of the key.

The plant is finer than the model and its exponents differ, so a true value exists only where the formula is
linear in the same product; powers of the speed are compared at the top speed of the machine.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

CATALOGUE = 1000.0  # rpm in which laws of the catalogue count speed

# effect -> how the name of the compared parameter begins, whether a power m of the speed is in the formula
COMPARED: Mapping[str, tuple[str, bool]] = {
    "fluid_convection": ("hF", False),
    "fluid_convection_speed": ("hN", True),
    "film_drag": ("q_d", True),
    "flooded_gap": ("G_gap", False),
    "fluid_delay": ("t_delay", False),
    "friction_speed": ("P_f", True),
    "rotating_air_convection": ("hR_air", True),
    "conduction_path": ("G_path", False),
    "second_thermal_mass": ("G_m", False),
    "bed_memory": ("G_bed", False),
    "unmeasured_heat": ("q_u", False),
    "draught": ("G_d", False),
    "sensor_gain": ("gain", False),
    "sensor_offset": ("offset", False),
    "sensor_drift": ("drift", False),
    "clock_shift": ("t_shift", False),
}


def covered(key: Mapping[str, Any], named: Mapping[str, Any]) -> bool | None:
    """Whether the 95 % interval of an effect holds the true size; None where they cannot be compared.

    >>> size = {"value": 38, "low": 35, "high": 41, "unit": "W/K"}
    >>> named = {"effect": "flooded_gap", "parameters": {"G_gap_a_b": size}}
    >>> covered({"effect": "flooded_gap", "size": 40.0, "unit": "W/K"}, named)
    True
    """
    effect = key["effect"]
    if named["effect"] != effect or effect not in COMPARED or "size" not in key:
        return None
    prefix, is_power = COMPARED[effect]
    parameters = named.get("parameters", {})
    entry = next(
        (p for name, p in parameters.items() if name == prefix or name.startswith(f"{prefix}_")), None
    )
    if entry is None or entry.get("low") is None or entry["low"] == entry["high"]:
        return None
    factor = 1.0
    if is_power:
        exponent = next(
            (p["value"] for name, p in parameters.items() if name == "m" or name.startswith("m_")), None
        )
        if exponent is None or "top_speed" not in key:
            return None
        factor = (key["top_speed"] / CATALOGUE) ** float(exponent)
    return bool(entry["low"] * factor <= key["size"] <= entry["high"] * factor)
