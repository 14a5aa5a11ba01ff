"""Fluid fills the gap between two bodies and couples them while the pump runs.

    q = G_gap flow (T_other - T)    [W] into one body and out of the other

G_gap in W/K, 10 to 100: 46 W/K for a gap of 1 mm and 0.08 m2 filled with emulsion, 2 W/K for air. Source:
conduction through the film, Taylor-Couette flow above the critical number. Limits: fills and drains at
once; no clogging.
"""

from discovery.effects.form import Amplitude, Effect, Example

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
    source=(
        "conduction through a fluid-filled gap of 1 mm: 46 W/K flooded against 2 W/K dry (Taylor-"
        "Couette above the critical number)"
    ),
    examples=(Example({"G_gap": 40.0, "flow": 1.0, "other": 25.0, "body": 22.0}, 120.0),),
)
