"""A recorded input changes the exchange of a body with the coolant: a valve, a second pump.

    q = G_in u/u_max (T_cool - T)    [W]

u: a recorded input whose law has no name of its own; G_in in W/K at the largest value that was recorded, of
either sign. Source: Dittus, Boelter 1930: Nu = 0.023 Re^0.8 Pr^0.4, so that a coefficient follows the flow.
Limits: in proportion to the input.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_exchange",
    title="A recorded input changes the cooling by the coolant",
    group="inputs",
    place="body",
    formula="G_in*level*(coolant - body)",
    amplitude=Amplitude("G_in", "W/K", 20.0, 0),
    signature="the body comes closer to the coolant, or less so, while a recorded input is on",
    confused_with=("input_heat", "coolant_convection"),
    source="Dittus, Boelter 1930: coefficients of a channel follow the flow, Nu = 0.023 Re^0.8 Pr^0.4",
    roles=("other input", "nozzle height", "fluid flow"),
    examples=(Example({"G_in": 20.0, "level": 0.5, "coolant": 20.0, "body": 26.0}, -60.0),),
)
