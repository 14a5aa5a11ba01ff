"""A recorded cooling takes heat out of a body that the model does not let it cool.

    q = -q_in P/P_max    [W]

P: a recorded cooling power; q_in in W at the largest value that was recorded. Source: heat balance of a body.
Limits: in proportion to the power, at once.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_heat",
    title="A recorded cooling reaches this body",
    group="inputs",
    place="body",
    formula="-q_in*level",
    amplitude=Amplitude("q_in", "W", 60.0),
    signature="heat is taken out in step with a recorded cooling",
    confused_with=("coolant_convection",),
    source="heat balance of a lumped body (Incropera, DeWitt, ch. 5); chillers of 10 W to 1 kW",
    roles=("cooling power",),
    examples=(Example({"q_in": 60.0, "level": 0.5}, -30.0),),
)
