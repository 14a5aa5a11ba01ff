"""The coolant that reaches the bodies is a mixed volume behind its sensor: it follows with a first-order lag.

    t_sump T_mix' = T_cool - T_mix;  T_mix replaces T_cool in every term of the coolant in the model

t_sump in s: content of tank, pipes and jackets over the flow. Source: heat balance of a stirred volume.
Limits: as `fluid_sump`.
"""

from dataclasses import replace

from discovery.effects.catalogue import fluid_sump
from discovery.effects.form import Example

EFFECT = replace(
    fluid_sump.EFFECT,
    title="Coolant remembers",
    place="coolant terms",
    formula="lag(coolant, t_sump)",
    signature="every cooled body follows a smoothed coolant temperature",
    source="heat balance of the content of tank, pipes and jackets",
    examples=(Example({"coolant": 26.0, "t_sump": 2700.0}, 24.53, {"coolant": 22.0}, 2700.0),),
)
