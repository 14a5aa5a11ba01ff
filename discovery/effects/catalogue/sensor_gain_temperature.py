"""One thermometer reads the difference to its cold junction with a wrong scale through one recording.

    temperature shown = y + gain (y - T_air)    [K]

gain of either sign, 0.02 to 0.3. Source: IEC 60584-1: a thermocouple of type J that is read as type K shows
some 27 % too much, counted from the cold junction, which is as warm as the air. Limits: as `sensor_gain`.
"""

from dataclasses import replace

from discovery.effects.catalogue import sensor_gain
from discovery.effects.form import Example

EFFECT = replace(
    sensor_gain.EFFECT,
    title="Scale of a thermometer",
    place="output that is a temperature",
    formula="gain*(y - ambient)",
    signature="one temperature of a recording is farther from the air in proportion, the others are not",
    source="IEC 60584-1: a thermocouple of type J read as type K shows some 27 % too much",
    examples=(Example({"gain": 0.1, "y": 32.0, "ambient": 22.0}, 1.0),),
)
