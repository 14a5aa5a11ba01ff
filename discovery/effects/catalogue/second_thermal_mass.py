"""The body is more than one mass: part of it follows behind a conductance.

    t_m T_m' = T - T_m,   q = G_m (T_m - T)    [W]

G_m in W/K, 5 to 200; t_m = C_m/G_m of 10 min to 4 h. Source: a hidden mass C_m behind G_m; a plate of
thickness L has t_m = L^2/(pi^2 a), 14 to 28 min. Limits: one discrete mass leaves part of the misfit of a
body that conducts over a distance; where the machine was not at rest, how it begins is one more unknown.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="second_thermal_mass",
    title="Second thermal mass",
    group="air and structure",
    place="body",
    formula="G_m*(lag(body, t_m) - body)",
    amplitude=Amplitude("G_m", "W/K", 30.0),
    shapes=(Shape("t_m", "s", None),),
    signature="fast then slow: the body soaks up heat after each change and gives it back",
    confused_with=(
        "conduction_path",
        "unmeasured_heat",
    ),
    source=(
        "a hidden mass C_m = G_m t_m behind a conductance: C_m dT_m/dt = G_m (body - T_m); inner time "
        "constants L^2/(pi^2 a) of 14 to 28 min"
    ),
    examples=(Example({"G_m": 30.0, "body": 26.0, "t_m": 1800.0}, -44.15, {"body": 22.0}, 1800.0),),
)
