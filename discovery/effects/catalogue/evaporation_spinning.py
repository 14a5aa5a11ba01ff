"""Evaporation from a surface that spins: the air that moves over it carries the vapour off, and warm fluid
evaporates faster.

    q = -q_ev w (1 + b n/1000) exp(0.06 (T - 22)),   w = max(s, film), t_dry film' = s - film    [W]

s is 1 while fluid flows and 0 while it does not. q_ev in W at standstill and 22 degC; b: 1 to 5 for surfaces
of 0.05 to 0.2 m2, 90 to 240 W/m2 still and 500 to 1400 W/m2 at 600 rpm; 6 % per kelvin is what the vapour
pressure of water does (Clausius-Clapeyron). Source: Lewis relation h_m = h/(rho c_p Le^(2/3)) with h of a
rotating disk. Limits: humidity is not recorded.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="evaporation_drying",
    title="Evaporation of the film from a spinning surface",
    group="cutting fluid",
    place="body",
    formula="-q_ev*max(sign(flow), lag(sign(flow), t_dry))*(1 + b_ev*speed/1000)*exp(0.06*(body - 22))",
    amplitude=Amplitude("q_ev", "W", 30.0),
    shapes=(Shape("t_dry", "s", 1800.0, factor=2.0, or_at_once=True), Shape("b_ev", "1", 2.0, factor=2.0)),
    signature="as evaporation, the more the faster the surface turns and the warmer it is",
    confused_with=("sensor_offset", "fluid_convection"),
    source="Lewis relation (Incropera, DeWitt, ch. 6.7): 90 to 240 W/m2 still, 500 to 1400 W/m2 spinning",
    shared=True,
    examples=(
        Example(
            {"q_ev": 30.0, "flow": 1.0, "t_dry": 1800.0, "b_ev": 2.0, "speed": 500.0, "body": 22.0}, -60.0
        ),
    ),
)
