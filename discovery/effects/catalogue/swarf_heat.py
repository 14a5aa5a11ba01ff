"""Swarf heats the body on which it lands, in proportion to a recorded cutting power.

    q = swarf P_other    [W]

swarf: share of the power, 0.05 to 0.15; P_other in W, a channel of role "other input". Source: 100
cm3/min of steel take 4.2 kW, 5 to 15 % of which stay on table and fluid. Limits: no way and no time
between the cut and the body.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="swarf_heat",
    title="Heat of hot swarf",
    group="cutting fluid",
    place="body",
    formula="swarf*other_input",
    amplitude=Amplitude("swarf", "1", 0.1),
    signature="heat pulses that follow the cutting power",
    confused_with=("unmeasured_heat",),
    source="100 cm3/min of steel take 4.2 kW, of which 5 to 15 % stay on table and fluid",
    examples=(Example({"swarf": 0.1, "other_input": 4000.0}, 400.0),),
)
