"""One error is read with a wrong scale through one recording.

    error shown = (1 + gain) y    [um]

gain of either sign, 0.02 to 0.2. Source: data sheets of eddy-current sensors, which are set for one metal and
are off by up to some 20 % on another; a bridge amplifier with another gauge factor. Limits: found only next
to a recording without it; the zero is that of the error.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="sensor_gain",
    title="Scale of a sensor",
    group="measuring chain",
    place="output that is no temperature",
    formula="gain*y",
    amplitude=Amplitude("gain", "1", 0.05, 0, most=1.0),
    signature="one error of a recording is larger or smaller in proportion, the others are not",
    confused_with=("sensor_offset", "sensor_drift"),
    source="eddy-current sensors set for another metal: off by up to some 20 %",
    acts="in one recording",
    examples=(Example({"gain": 0.1, "y": 20.0}, 2.0),),
)
