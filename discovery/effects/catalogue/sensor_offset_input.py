"""The sensor of an input shows too much, from a recording on: it was replaced, moved, or is wrong from the
start.

    T_in - offset replaces T_in in every term and output of the model

offset in K, of either sign, 0.5 to 3 for thermocouples and for a sensor that hangs in another place. Source:
IEC 60584-1:2013, class 2: 2.5 K. Limits: temperatures alone, up to 100 K; start values keep what was
recorded.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="sensor_offset",
    title="Offset of the sensor of an input",
    group="measuring chain",
    place="input temperature",
    formula="input - offset",
    amplitude=Amplitude("offset", "K", 1.0, 0, most=100.0),
    signature="every body that an input drives is off in the same direction, from a recording on",
    confused_with=("bed_memory", "air_convection", "unmeasured_heat"),
    source="IEC 60584-1:2013: thermocouples of class 2 are within 2.5 K",
    acts="from a recording on",
    examples=(Example({"input": 21.0, "offset": 1.5}, 19.5),),
)
