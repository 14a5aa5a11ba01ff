"""A recorded input changes the exchange between two bodies: a second flow, a clutch, a fan inside.

    q = G_in u/u_max (T_other - T)    [W] into one body and out of the other

u: a recorded input whose law has no name of its own; G_in in W/K at the largest value that was recorded, of
either sign. Source: Newton's law of cooling with a coefficient that follows the flow (VDI Heat Atlas, G).
Limits: in proportion to the input.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_exchange",
    title="A recorded input changes the exchange of two bodies",
    group="inputs",
    place="any pair",
    formula="G_in*level*(other - body)",
    amplitude=Amplitude("G_in", "W/K", 20.0, 0),
    signature="two bodies come closer in temperature while a recorded input is on",
    confused_with=("flooded_gap", "conduction_path"),
    source="VDI Heat Atlas, part G: coefficients of forced convection follow the flow",
    roles=("other input", "nozzle height", "fluid flow"),
    examples=(Example({"G_in": 20.0, "level": 0.5, "other": 30.0, "body": 25.0}, 50.0),),
)
