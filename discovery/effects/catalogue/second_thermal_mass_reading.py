"""A thermometer stands between a body and a hidden mass that follows it.

    t_m T_m' = T - T_m,   the temperature shown = y + share_m (T_m - T)    [K]

share_m: 0 at the body, 1 at the hidden mass. What a thermometer shows lies between the temperatures that it
touches, so that no share is larger; t_m: whatever the recordings can show. Source: as `second_thermal_mass`.
Limits: takes no heat from the body; settled at the first instant.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="second_thermal_mass",
    title="Second thermal mass that the thermometer touches",
    group="air and structure",
    place="thermometer",
    formula="share_m*(lag(body, t_m) - body)",
    amplitude=Amplitude("share_m", "1", 0.3, most=1.0),
    shapes=(Shape("t_m", "s", None),),
    signature="a temperature comes fast at first, then slowly with a second time constant",
    confused_with=("input_path", "sensor_lag"),
    source=(
        "a hidden mass C_m = G_m t_m behind a conductance; inner time constants L^2/(pi^2 a) of 14 to 28 min"
    ),
    examples=(Example({"share_m": 0.3, "body": 26.0, "t_m": 1800.0}, -0.4415, {"body": 22.0}, 1800.0),),
)
