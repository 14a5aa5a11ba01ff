"""A recorded temperature reaches an error by a path of its own, with a time constant of its own.

    error shown = y + k (lag(T_in, t_path) - T_in at the start)    [um]

k in um/K, of either sign: a part that grows with that temperature, as a frame with its heated bed; t_path:
whatever the recordings can show. Source: sums of first-order responses, eq. (8) of Mayr et al. 2015. Limits:
one time constant, for heat takes its time; settled at the first instant, from which the error is counted.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="input_path",
    title="A separate path from a recorded temperature to an error",
    group="inputs",
    place="output that is no temperature",
    formula="k_path*(lag(input, t_path) - lag(input, 1e9))",
    amplitude=Amplitude("k_path", "um/K", 3.0, 0),
    shapes=(Shape("t_path", "s", None),),
    signature="one error follows a recorded temperature with a time constant that the model does not have",
    confused_with=("second_thermal_mass", "sensor_lag"),
    source="Mayr et al. 2015, eq. (8): an error is a sum of first-order responses to its inputs",
    roles=("ambient temperature", "fluid temperature", "coolant temperature", "temperature", "other input"),
    inputs_in="degC",
    examples=(Example({"k_path": 3.0, "input": 60.0, "t_path": 600.0}, 75.85, {"input": 20.0}, 600.0),),
)
