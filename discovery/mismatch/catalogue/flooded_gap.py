"""Fluid fills the gap between two bodies and couples them while the pump runs."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="flooded_gap",
    title="Flooded gap",
    group="cutting fluid",
    place="any pair",
    formula="G_gap*flow*(other - body)",
    amplitude=Amplitude("G_gap", "W/K", 40.0),
    signature="two bodies come closer in temperature only while the pump runs",
    confused_with=(
        "conduction_path",
        "fluid_convection",
    ),
    source="conduction through a fluid-filled gap of 1 mm: 46 W/K flooded against 2 W/K dry (Taylor-Couette above the critical number)",
    examples=(Example({"G_gap": 40.0, "flow": 1.0, "other": 25.0, "body": 22.0}, 120.0),),
)
