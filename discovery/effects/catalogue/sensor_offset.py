"""One error jumps at an instant of one recording and stays there.

    error shown = y + offset where time >= t_step    [um]

offset in the unit of the error, of either sign. Source: a nest or sensor that was touched: heat moves
neighbouring errors too, this does not. Limits: one jump per error and recording in the search.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="sensor_offset",
    title="Offset of a sensor",
    group="measuring chain",
    place="output of a recording",
    formula="offset*where(time >= t_step, 1, 0)",
    amplitude=Amplitude("offset", "um", 4.0, 0),
    shapes=(Shape("t_step", "s", 0.0, instant=True),),
    signature="one error jumps between two readings and stays, the others do not",
    confused_with=(
        "heat_pulse",
        "unmeasured_heat",
        "rezero",
    ),
    source="a nest or sensor that was touched: one direction jumps and stays",
    search="step",
    acts="in one recording",
    examples=(Example({"offset": 4.0, "time": 5000.0, "t_step": 3600.0}, 4.0),),
)
