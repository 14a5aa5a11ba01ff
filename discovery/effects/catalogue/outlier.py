"""A single reading that is wrong.

    error shown = y + outlier at the one instant t_first    [um]

outlier in the unit of the error, of either sign, far above the noise. Source: a chip in the nest, the
E_A0C peak of 125 in the paper. Limits: one reading; two in a row are a jump that came back.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="outlier",
    title="Single wrong reading",
    group="measuring chain",
    place="output of a recording",
    formula="outlier*where(time >= t_first, 1, 0)*where(time <= t_first, 1, 0)",
    amplitude=Amplitude("outlier", "um", 20.0, 0),
    shapes=(Shape("t_first", "s", 0.0, instant=True),),
    signature="one reading of one error, alone",
    confused_with=("sensor_offset",),
    source=(
        "a chip in the nest: one reading is wrong, the next is right again (the paper's E_A0C peak of 125)"
    ),
    search="single readings",
    acts="in one recording",
    examples=(Example({"outlier": 20.0, "time": 600.0, "t_first": 600.0}, 20.0),),
)
