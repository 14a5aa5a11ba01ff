"""A recorded input reaches an error by a path of its own, with a time constant of its own.

    error shown = y + k lag(u/u_max, t_path)    [um]

k in the unit of the error at the largest value that was recorded, of either sign; t_path: whatever the
recordings can show, or none: a load bends a frame at once. Source: sums of first-order responses, eq. (8) of
Mayr et al. 2015. Limits: one time constant; settled at the first instant.
"""

from discovery.effects.form import DRIVING, Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="input_path",
    title="A separate path from a recorded input to an error",
    group="inputs",
    place="output that is no temperature",
    formula="k_path*lag(level, t_path)",
    amplitude=Amplitude("k_path", "um", 10.0, 0),
    shapes=(Shape("t_path", "s", None, or_at_once=True),),
    signature="one error follows a recorded input with a time constant that the model does not have",
    confused_with=("second_thermal_mass", "sensor_lag"),
    source="Mayr et al. 2015, eq. (8): an error is a sum of first-order responses to its inputs",
    roles=DRIVING,
    examples=(Example({"k_path": 10.0, "level": 1.0, "t_path": 600.0}, 6.321, {"level": 0.0}, 600.0),),
)
