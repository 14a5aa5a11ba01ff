"""Viscous friction that falls as the oil warms up.

    q = P_v (n/1000)^m_oil exp(-k_oil (T - 22))    [W]

P_v in W at 1000 rpm and 22 degC, 30 to 400; m_oil of 1.67 to 2; k_oil of 0.03/K for oil, more for stiff
grease. Source: Palmgren M_v ~ nu^(2/3) with d ln(nu)/dT = -0.045/K. Limits: the body is as warm as its
bearing.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="viscosity_temperature",
    title="Oil gets thinner",
    group="drive and cooling",
    place="driven body",
    formula="P_v*(speed/1000)**m_oil*exp(-k_oil*(body - 22))",
    amplitude=Amplitude("P_v", "W", 150.0),
    shapes=(Shape("m_oil", "1", 1.8, factor=1.2), Shape("k_oil", "1/K", 0.035, factor=1.6)),
    signature="friction is largest at a cold start and falls as the body warms up",
    confused_with=(
        "friction_speed",
        "thermal_preload",
    ),
    source=(
        "Palmgren M_v ~ nu^(2/3) with d ln(nu)/dT = -0.045/K: friction falls by 3 % per kelvin or more "
        "with stiff grease"
    ),
    shared=True,
    examples=(Example({"P_v": 80.0, "speed": 1000.0, "m_oil": 2.0, "k_oil": 0.03, "body": 22.0}, 80.0),),
)
