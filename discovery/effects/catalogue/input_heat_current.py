"""A recorded current heats a body by its square, and the model does not use it there in this way.

    q = q_sq (I/I_max)^2    [W]

I: a recorded input in A; q_sq in W at the largest current that was recorded. A model may follow the current
in proportion, as the heat that a thermoelectric cooler pumps or that a cell sets free, and leave out what the
resistance makes of it. Source: Joule's law; 1 W in a small coil to some kW in a drive. Limits: the resistance
is constant; a current that is only switched on and off heats in proportion just as well.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_heat",
    title="A recorded current heats this body",
    group="inputs",
    place="body",
    formula="q_sq*level**2",
    amplitude=Amplitude("q_sq", "W", 60.0),
    signature="the missing heat follows the square of a recorded current",
    confused_with=("input_exchange", "unmeasured_heat"),
    source="Joule's law (Incropera, DeWitt, ch. 3, on thermal energy generation); 1 W to some kW",
    roles=("other input",),
    inputs_in="A",
    shared=True,
    examples=(Example({"q_sq": 60.0, "level": 0.5}, 15.0),),
)
