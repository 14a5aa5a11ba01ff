"""A recorded power heats a body that the model does not let it heat.

    q = q_in P/P_max    [W]

P: a recorded heat load; q_in in W at the largest value that was recorded. Source: heat balance of a body:
what a drive takes and does not put into work is heat, somewhere. Limits: in proportion to the power, at once.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_heat",
    title="A recorded power heats this body",
    group="inputs",
    place="body",
    formula="q_in*level",
    amplitude=Amplitude("q_in", "W", 60.0),
    signature="the missing heat follows a recorded power",
    confused_with=("friction_speed", "conduction_path"),
    source="heat balance of a lumped body (Incropera, DeWitt, ch. 5); losses of drives of 10 W to 1 kW",
    roles=("heat load",),
    examples=(Example({"q_in": 60.0, "level": 0.5}, 30.0),),
)
