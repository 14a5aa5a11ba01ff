"""Cutting fluid on a body that the model leaves dry.

While the pump runs the body exchanges heat with the fluid, 5 to 600 W/K. Bilinear: no constant time constant
can stand for it.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="fluid_convection",
    title="Convection of the cutting fluid",
    group="cutting fluid",
    place="fluid-free body",
    formula="hF*flow*(fluid - body)",
    amplitude=Amplitude("hF", "W/K", 40.0),
    signature="the rate of the errors jumps when the pump switches, as long as fluid and body differ in temperature",
    confused_with=(
        "fluid_convection_speed",
        "flooded_gap",
    ),
    source="Newton's law of cooling, gated by the pump; structure of the paper's section 3 (Table and C-Body 1)",
    examples=(Example({"hF": 30.0, "flow": 1.0, "fluid": 26.0, "body": 22.0}, 120.0),),
)
