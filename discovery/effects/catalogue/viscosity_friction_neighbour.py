"""Losses that are nominal: the friction in them falls as oil warms up that is a body of its own.

    q = c_oil (exp(-k_oil (T_oil - 22)) - 1) q_loss    [W]

As `viscosity_friction`, with the temperature of a body that is linked to the one that the loss heats: a gear
that runs in a sump, a spindle in its oil. Source: Palmgren, M_v ~ nu^(2/3), with d ln(nu)/dT = -0.045/K.
Limits: the oil is as warm where it is sheared as where it is read; the model's loss is right at 22 degC.
"""

from dataclasses import replace

from discovery.effects.catalogue import viscosity_friction
from discovery.effects.form import Example

EFFECT = replace(
    viscosity_friction.EFFECT,
    title="Oil of a neighbour gets thinner",
    place="loss terms and a neighbour",
    formula="c_oil*(exp(-k_oil*(other - 22)) - 1)*term",
    signature="losses heat a body less the warmer the oil next to it is",
    examples=(Example({"c_oil": 1.0, "k_oil": 0.03, "other": 32.0, "term": 100.0}, -25.92),),
)
