"""A recorded input heats a body (or cools it), and the model does not use it there.

    q = q_in u/u_max    [W]

u: any recorded input that is no temperature and whose law has no name of its own, as a power, a valve, a
heater in percent; q_in in W at the largest value that was recorded, of either sign. Source: heat balance of a
body; a heater of 10 W to 1 kW. Limits: in proportion to the input, at once; several bodies get the same heat,
as rooms or collectors in the sun, or each its own.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_heat",
    title="A recorded input heats this body",
    group="inputs",
    place="body",
    formula="q_in*level",
    amplitude=Amplitude("q_in", "W", 60.0, 0),
    signature="the missing heat follows a recorded input",
    confused_with=("input_exchange", "unmeasured_heat"),
    source="heat balance of a lumped body (Incropera, DeWitt, ch. 5); heaters of 10 W to 1 kW",
    roles=("other input", "nozzle height", "fluid flow"),
    shared=True,
    examples=(Example({"q_in": 60.0, "level": 0.5}, 30.0),),
)
