"""A part of an error follows with a time constant of its own: a further mass of a model of errors.

    error shown = y + k (lag(y, t_m) - y)    [um]

k: share of the error, of either sign; t_m: whatever the recordings can show. Source: as
`second_thermal_mass`, for models whose states are the errors themselves. Limits: settled at the first
instant.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="second_thermal_mass",
    title="A second time constant",
    group="air and structure",
    place="output of errors",
    formula="k_m*(lag(y, t_m) - y)",
    amplitude=Amplitude("k_m", "1", 0.5, 0),
    shapes=(Shape("t_m", "s", None),),
    signature="fast then slow: a part of the error lags behind",
    confused_with=("sensor_lag", "input_path"),
    source=(
        "a hidden mass C_m = G_m t_m behind a conductance; inner time constants L^2/(pi^2 a) of 14 to 28 min"
    ),
    examples=(Example({"k_m": 0.5, "y": 10.0, "t_m": 600.0}, -1.839, {"y": 0.0}, 600.0),),
)
