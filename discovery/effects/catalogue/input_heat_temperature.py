"""A recorded temperature heats a body through a path that the model does not have.

    q = G_in (T_in - T)    [W]

T_in: a recorded temperature that is neither the room, the fluid nor the coolant, and that the model does not
predict: a heated bed, a neighbouring part; G_in in W/K, 1 to 100. Source: Fourier's law. Limits: no storage
on the way. A body that follows another thermometer faster than readings come is what that thermometer reads.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_heat",
    title="A recorded temperature heats this body",
    group="inputs",
    place="body",
    formula="G_in*(input - body)",
    amplitude=Amplitude("G_in", "W/K", 10.0),
    signature="the body follows a recorded temperature that the model does not use there",
    confused_with=("air_convection", "conduction_path"),
    source="Fourier's law (Incropera, DeWitt, ch. 2); joints and webs of 1 to 100 W/K",
    roles=("temperature", "other input"),
    inputs_in="degC",
    examples=(Example({"G_in": 10.0, "input": 60.0, "body": 25.0}, 350.0),),
)
