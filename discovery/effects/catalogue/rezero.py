"""All errors of a recording jump at the same instant and stay.

    every error shown = y + zero_j where time >= t_zero    [um]

zero_j in the unit of each error, of either sign, one size per error. Source: the R-Test is set to zero
again within a recording. Limits: one instant a recording; what jumps in one error alone is
`sensor_offset`.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="rezero",
    title="Device set to zero",
    group="measuring chain",
    place="recording",
    formula="zero*where(time >= t_zero, 1, 0)",
    amplitude=Amplitude("zero", "um", 5.0, 0),
    shapes=(Shape("t_zero", "s", 0.0, instant=True),),
    signature="all errors jump between two readings and stay",
    confused_with=("sensor_offset",),
    source="the R-Test is set to zero again within a recording",
    search="step",
    acts="in one recording",
    examples=(Example({"zero": 3.0, "time": 700.0, "t_zero": 600.0}, 3.0),),
)
