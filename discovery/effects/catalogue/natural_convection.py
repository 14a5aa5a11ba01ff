"""Free convection: a film coefficient that grows with the temperature difference.

    q = c ((|T_env - T|/5 K)^n - 1) q_air    [W]

q_air is what the model lets flow to the air there, with a coefficient that is right at 5 K; c: share of it
that is free convection, up to 1; n of 1/4 (laminar) to 1/3 (turbulent). Source: Churchill, Chu 1975; McAdams
1954: 1.9 W/m2K at 1 K, 4.2 W/m2K at 10 K. Limits: only what differs from a linear loss is seen; rarely
decidable against `radiation`.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="natural_convection",
    title="Free convection",
    group="air and structure",
    place="air terms",
    formula="c_nat*((abs(ambient - body)/5)**n - 1)*term",
    amplitude=Amplitude("c_nat", "1", 1.0, most=1.5),
    shapes=(Shape("n", "1", 0.29, factor=1.15),),
    signature="the loss to the air grows faster than the temperature difference: slower tails near balance",
    confused_with=("radiation", "contact_conductance"),
    source="Churchill, Chu 1975: Nusselt numbers of free convection follow Ra^(1/4) to Ra^(1/3)",
    examples=(
        Example({"c_nat": 1.0, "ambient": 20.0, "body": 25.0, "n": 0.25, "term": 30.0}, 0.0),
        Example({"c_nat": 1.0, "ambient": 20.0, "body": 100.0, "n": 0.25, "term": 30.0}, 30.0),
    ),
)
