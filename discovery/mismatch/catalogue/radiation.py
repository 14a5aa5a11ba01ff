"""Thermal radiation to the room with an effective (emissivity times) area."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="radiation",
    title="Radiation",
    group="air and structure",
    place="air body",
    formula="A_rad*5.67e-8*((ambient + 273.15)**4 - (body + 273.15)**4)",
    amplitude=Amplitude("A_rad", "m2", 1.0),
    signature="loss to the surroundings with the fourth power; invisible unless the body is tens of kelvin above the room",
    confused_with=(
        "natural_convection",
        "air_convection",
    ),
    source="Stefan-Boltzmann; over 10 K only 5 % of it differ from a linear loss",
    examples=(Example({"A_rad": 1.0, "ambient": 20.0, "body": 30.0}, -60.08),),
)
