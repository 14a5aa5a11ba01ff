"""Cutting fluid on a body that the model leaves dry.

    q = hF flow (T_fluid - T)    [W]

hF in W/K at flow 1 (pump on, or per l/min): 5 to 30 for splashes, up to 600 for a flooded table. Source:
Newton's law of cooling, gated by the pump; structure of the paper's section 3. Bilinear: no constant time
constant can stand for it. Limits: in proportion to the flow; a body that the model wets already is not
offered.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="fluid_convection",
    title="Convection of the cutting fluid",
    group="cutting fluid",
    place="fluid-free body",
    formula="hF*flow*(fluid - body)",
    amplitude=Amplitude("hF", "W/K", 40.0),
    signature=(
        "the rate of the errors jumps when the pump switches, as long as fluid and body differ in temperature"
    ),
    confused_with=(
        "fluid_convection_speed",
        "flooded_gap",
    ),
    source=(
        "Newton's law of cooling, gated by the pump; structure of the paper's section 3 (Table and C-Body 1)"
    ),
    examples=(Example({"hF": 30.0, "flow": 1.0, "fluid": 26.0, "body": 22.0}, 120.0),),
)
