"""Evaporation from a wet surface, going on after the pump stops until the film is dry.

    q = -q_ev max(s, w),   t_dry w' = s - w    [W]

s is 1 while fluid flows and 0 while it does not: a surface is wet at any flow. q_ev in W: 90 to 240 W/m2 on
a still surface, 500 to 1400 W/m2 on a spinning one, on 0.05 to 0.2 m2; t_dry of 5 to 60 min for a film of
0.05 to 0.2 kg/m2. Source: Lewis relation h_m = h/(rho c_p Le^2/3), here at constant humidity. Limits:
humidity is not recorded, so q_ev is a mean over the recording; the film thins out exponentially.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="evaporation_drying",
    title="Evaporation of the film",
    group="cutting fluid",
    place="body",
    formula="-q_ev*max(sign(flow), lag(sign(flow), t_dry))",
    amplitude=Amplitude("q_ev", "W", 60.0),
    shapes=(Shape("t_dry", "s", 1800.0, factor=2.0, or_at_once=True),),
    signature=(
        "after a pump stop the body cools below the air for the drying time; while wet it stays below "
        "the fluid"
    ),
    confused_with=(
        "sensor_offset",
        "fluid_convection",
    ),
    source=(
        "Lewis relation: 500 to 1400 W/m2 on a spinning wet table; film of 0.05 to 0.2 kg/m2 dries "
        "within 5 to 60 min"
    ),
    shared=True,
    examples=(
        Example({"q_ev": 60.0, "flow": 1.0, "t_dry": 2400.0}, -60.0),
        # the same at 80 l/min
        Example({"q_ev": 60.0, "flow": 80.0, "t_dry": 2400.0}, -60.0),
        # one drying time after a pump stop
        Example({"q_ev": 60.0, "flow": 0.0, "t_dry": 2400.0}, -22.07, {"flow": 1.0}, 2400.0),
    ),
)
