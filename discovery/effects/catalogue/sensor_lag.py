"""One error (or measured temperature) is read through a first-order lag.

    t_lag s' = y - s,   s is shown instead of y

t_lag in s: 30 to 300 s behind a wall or in a housing. Source: first-order sensor. Limits: visible only
where readings come faster than t_lag; settled at the first instant. Not for a model without states: there,
what lags is the body.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="sensor_lag",
    title="Lag of a sensor",
    group="measuring chain",
    place="output of a state",
    formula="lagged*(lag(y, t_lag) - y)",
    amplitude=Amplitude("lagged", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_lag", "s", 60.0, factor=3.0),),
    signature="one error follows late and smoothed",
    confused_with=(
        "clock_shift",
        "second_thermal_mass",
        "heater_mass",
    ),
    source="sensors behind a wall or in a housing: 30 to 300 s",
    examples=(Example({"lagged": 1.0, "y": 10.0, "t_lag": 60.0}, -3.679, {"y": 0.0}, 60.0),),
)
