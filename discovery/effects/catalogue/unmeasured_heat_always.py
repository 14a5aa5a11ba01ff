"""Heat at a body that is always there and that no channel explains.

    q = q_u    [W], in every recording

q_u in W, positive: electronics, a fan or a pump that are never off, a room or a housing that is warmer than
the sensor of the air. Source: standby power of machine tools (ISO 14955-1). Limits: where one body alone
follows the air, it is the same as an offset of the sensor of the air, and both are rivals.
"""

from dataclasses import replace

from discovery.effects.catalogue import unmeasured_heat
from discovery.effects.form import Example

EFFECT = replace(
    unmeasured_heat.EFFECT,
    title="Heat that is always there",
    formula="q_u",
    shapes=(),
    signature="a body stays warmer than its model in every recording, whatever the inputs do",
    confused_with=("sensor_offset", "air_convection"),
    source="ISO 14955-1:2017: power of machine tools in standby, 10 % and more of the usual power",
    search="shapes",
    acts="always",
    examples=(Example({"q_u": 80.0}, 80.0),),
)
