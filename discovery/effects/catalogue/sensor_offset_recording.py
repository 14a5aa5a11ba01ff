"""One thermometer is off by a constant through the whole of one recording.

    temperature shown = y + bias    [K]

bias in K, of either sign. As `sensor_offset`, from before the first reading on: a thermometer that was
replaced. Source: a thermocouple of class 2 is off by up to 2.5 K (IEC 60584-1). Limits: found only next to a
recording without it; an error counts from its first reading and has none.
"""

from dataclasses import replace

from discovery.effects.catalogue import sensor_offset
from discovery.effects.form import Amplitude, Example

EFFECT = replace(
    sensor_offset.EFFECT,
    title="Offset of a sensor in a whole recording",
    place="output that is a temperature",
    formula="bias",
    amplitude=Amplitude("bias", "um", 4.0, 0),
    shapes=(),
    search="shapes",
    signature="one temperature of a recording is off by a constant, from its first reading on",
    source="a thermometer that was replaced: a thermocouple of class 2 is off by up to 2.5 K (IEC 60584-1)",
    examples=(Example({"bias": 4.0}, 4.0),),
)
