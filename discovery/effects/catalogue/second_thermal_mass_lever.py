"""A hidden mass follows a body and moves the errors with a lever of its own.

    t_m T_m' = T - T_m,   each error shown = y + k_j (T_m - T)    [um]

k_j in um/K, of either sign, one for each error: a part that a body heats, too small to cool it, but long
enough to be seen; t_m: whatever the recordings can show. Source: as `second_thermal_mass`. Limits: takes no
heat from the body; settled at the first instant.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="second_thermal_mass",
    title="Second thermal mass with its own lever",
    group="air and structure",
    place="lever",
    formula="k_m*(lag(body, t_m) - body)",
    amplitude=Amplitude("k_m", "um/K", 2.0, 0),
    shapes=(Shape("t_m", "s", None),),
    signature="errors follow a body with a second time constant",
    confused_with=("input_path", "sensor_lag"),
    source=(
        "a hidden mass C_m = G_m t_m behind a conductance; inner time constants L^2/(pi^2 a) of 14 to 28 min"
    ),
    examples=(Example({"k_m": 2.0, "body": 26.0, "t_m": 1800.0}, -2.943, {"body": 22.0}, 1800.0),),
)
