"""Fluid couples two bodies while the pump runs, and no longer: it leaves a wide gap at once.

    q = G_gap s (T_other - T)    [W] into one body and out of the other

s is 1 while fluid flows and 0 while it does not. G_gap in W/K, 10 to 100. Source: as `flooded_gap`,
conduction through a film of 1 mm. Limits: fills and drains within a step of the readings.
"""

from dataclasses import replace

from discovery.effects.catalogue import flooded_gap
from discovery.effects.form import Example

EFFECT = replace(
    flooded_gap.EFFECT,
    title="Flooded gap that drains at once",
    formula="G_gap*sign(flow)*(other - body)",
    shapes=(),
    signature="two bodies come closer in temperature while the pump runs",
    source="conduction through a fluid-filled gap of 1 mm: 46 W/K flooded against 2 W/K dry",
    examples=(
        Example({"G_gap": 40.0, "flow": 1.0, "other": 25.0, "body": 22.0}, 120.0),
        Example({"G_gap": 40.0, "flow": 0.0, "other": 25.0, "body": 22.0}, 0.0),
    ),
)
