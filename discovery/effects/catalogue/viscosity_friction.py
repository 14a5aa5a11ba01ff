"""Recorded losses that are nominal: the friction in them falls as the oil warms up.

    q = c_oil (exp(-k_oil (T - 22)) - 1) q_loss    [W]

q_loss is what the losses of the model are there; c_oil: share of them that is viscous, up to 1; k_oil of
0.03/K for oil, more for stiff grease. Source: Palmgren, M_v ~ nu^(2/3), with d ln(nu)/dT = -0.045/K. Limits:
the body is as warm as its bearing; the model's loss is right at 22 degC.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="viscosity_temperature",
    title="Oil gets thinner, of recorded losses",
    group="drive and cooling",
    place="loss terms",
    formula="c_oil*(exp(-k_oil*(body - 22)) - 1)*term",
    amplitude=Amplitude("c_oil", "1", 0.7, most=1.5),
    shapes=(Shape("k_oil", "1/K", 0.035, factor=1.6),),
    signature="recorded losses heat less the warmer the body is",
    confused_with=("thermal_preload", "natural_convection"),
    source=(
        "Palmgren M_v ~ nu^(2/3) with d ln(nu)/dT = -0.045/K: friction falls by 3 % per kelvin or more "
        "with stiff grease"
    ),
    examples=(Example({"c_oil": 1.0, "k_oil": 0.03, "body": 32.0, "term": 100.0}, -25.92),),
)
