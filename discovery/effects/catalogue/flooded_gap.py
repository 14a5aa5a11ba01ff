"""Fluid fills the gap between two bodies and couples them while the pump runs, and until the gap has drained.

    q = G_gap max(s, w) (T_other - T)    [W] into one body and out of the other,   t_gap w' = s - w

s is 1 while fluid flows and 0 while it does not: a gap is full at any flow.

G_gap in W/K, 10 to 100: 46 W/K for a gap of 1 mm and 0.08 m2 filled with emulsion, 2 W/K for air; t_gap of 1
to 60 min: a narrow gap drains through its seals and by its own film. Source: conduction through the film,
Taylor-Couette flow above the critical number; a draining film thins out with the square root of time
(Jeffreys 1930). Limits: fills at once; drains exponentially; no clogging.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="flooded_gap",
    title="Flooded gap",
    group="cutting fluid",
    place="any pair",
    formula="G_gap*max(sign(flow), lag(sign(flow), t_gap))*(other - body)",
    amplitude=Amplitude("G_gap", "W/K", 40.0),
    shapes=(Shape("t_gap", "s", 600.0, factor=3.0, or_at_once=True),),
    signature="two bodies come closer in temperature while the pump runs and until the gap has drained",
    confused_with=(
        "conduction_path",
        "fluid_convection",
    ),
    source=(
        "conduction through a fluid-filled gap of 1 mm: 46 W/K flooded against 2 W/K dry (Taylor-"
        "Couette above the critical number); drains within 1 to 60 min"
    ),
    examples=(
        Example({"G_gap": 40.0, "flow": 1.0, "t_gap": 600.0, "other": 25.0, "body": 22.0}, 120.0),
        # one draining time after a pump stop
        Example(
            {"G_gap": 40.0, "flow": 0.0, "t_gap": 600.0, "other": 25.0, "body": 22.0},
            44.15,
            {"flow": 1.0},
            600.0,
        ),
    ),
)
