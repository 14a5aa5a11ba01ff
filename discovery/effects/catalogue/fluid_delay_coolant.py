"""The coolant reaches the bodies later than its temperature sensor says.

    T_cool(t) in every term of the coolant in the model becomes T_cool(t - t_delay)

t_delay in s: 10 s to 20 min, the content of pipes and jackets over the flow. Source: plug flow. Limits: as
`fluid_delay`.
"""

from dataclasses import replace

from discovery.effects.catalogue import fluid_delay
from discovery.effects.form import Example, Shape

EFFECT = replace(
    fluid_delay.EFFECT,
    title="Delay in the coolant circuit",
    place="coolant terms",
    formula="delay(coolant, t_delay)",
    shapes=(Shape("t_delay", "s", 110.0, factor=3.3, apart=1.5, is_shift=True),),
    signature="every cooled body answers to the coolant temperature later than it is measured",
    source="plug flow through pipes and jackets",
    examples=(Example({"coolant": 26.0, "t_delay": 1200.0}, 22.0, {"coolant": 22.0}, 1000.0),),
)
