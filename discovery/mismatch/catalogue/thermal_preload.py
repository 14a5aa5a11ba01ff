"""A warm shaft tightens its bearing: friction grows with the temperature rise."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="thermal_preload",
    title="Preload grows with heat",
    group="drive and cooling",
    place="driven body",
    formula="P_k*speed/1000*(body - ambient)",
    amplitude=Amplitude("P_k", "W/K", 4.0),
    signature="power rises during warm-up: positive feedback, opposite to oil viscosity",
    confused_with=("viscosity_temperature",),
    source="bearing preload study: friction torque rises 1 to 5 % per kelvin between inner and outer ring",
    examples=(Example({"P_k": 2.0, "speed": 1000.0, "body": 27.0, "ambient": 22.0}, 10.0),),
)
