"""One error drifts in a straight line through one recording.

    error shown = y + drift time/86400    [um]

drift in the unit of the error per day, of either sign: 0.5 to 1 um a day for displacement sensors and
electronics. Source: data sheets. Limits: straight; over a short recording a slow body or `bed_memory`
look the same.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="sensor_drift",
    title="Drift of a sensor",
    group="measuring chain",
    place="output of a recording",
    formula="drift*time/86400",
    amplitude=Amplitude("drift", "um/day", 2.0, 0),
    signature="one error runs away in a straight line, unrelated to any input",
    confused_with=(
        "bed_memory",
        "wear",
    ),
    source="displacement sensors and their electronics: 0.5 to 1 um a day",
    acts="in one recording",
    examples=(Example({"drift": 1.0, "time": 43200.0}, 0.5),),
)
