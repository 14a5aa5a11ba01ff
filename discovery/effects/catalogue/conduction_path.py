"""Heat flows between two bodies that the model does not link.

    q = G_path (T_other - T)    [W] into one body and out of the other

G_path in W/K, 5 to 60: lambda A / L of a steel web, or a joint. Source: Fourier's law. Limits: no storage
on the way; a long path answers later than this (see `second_thermal_mass`).
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="conduction_path",
    title="Another path of conduction",
    group="air and structure",
    place="pair",
    formula="G_path*(other - body)",
    amplitude=Amplitude("G_path", "W/K", 25.0),
    signature="two bodies come closer in temperature, wet or dry",
    confused_with=(
        "flooded_gap",
        "second_thermal_mass",
    ),
    source="Fourier's law between two bodies that the model does not link",
    examples=(Example({"G_path": 20.0, "other": 25.0, "body": 22.0}, 60.0),),
)
