"""The readings of one output carry the stamps of another clock in one recording: they come late.

    shown(t) = y(t - t_late) = 2 s - y,   (t_late/2) s' = y - s

t_late in s, as long as the recordings can show. Written with a first-order lag (Pade's approximation of a
delay). Source: two loggers with clocks of their own. Limits: late, not early; by less than y takes to move;
one shift for a whole recording; settled at the first instant.
"""

from dataclasses import replace

from discovery.effects.catalogue import clock_shift
from discovery.effects.form import Amplitude, Example, Shape

EFFECT = replace(
    clock_shift.EFFECT,
    title="Shifted clock of one output",
    place="output next to others",
    formula="late*2*(lag(y, 0.5*t_late) - y)",
    amplitude=Amplitude("late", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_late", "s", None),),
    signature="one error of a recording is late, the others are not",
    confused_with=("sensor_lag", "unmeasured_heat"),
    examples=(Example({"late": 1.0, "y": 10.0, "t_late": 600.0}, -2.707, {"y": 0.0}, 600.0),),
)
