"""The body is more than one mass: part of it follows behind a conductance."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="second_thermal_mass",
    title="Second thermal mass",
    group="air and structure",
    place="body",
    formula="G_m*(lag(body, t_m) - body)",
    amplitude=Amplitude("G_m", "W/K", 30.0),
    shapes=(Shape("t_m", "s", (900.0, 1800.0, 3600.0, 7200.0, 14400.0), 400.0, 40000.0),),
    signature="fast then slow: the body soaks up heat after each change and gives it back",
    confused_with=(
        "conduction_path",
        "unmeasured_heat",
    ),
    source="a hidden mass C_m = G_m t_m behind a conductance: C_m dT_m/dt = G_m (body - T_m); inner time constants L^2/(pi^2 a) of 14 to 28 min",
)
