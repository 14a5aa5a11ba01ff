"""The fluid that wets the bodies is a mixed volume behind the sensor: it follows with a first-order lag.

    t_sump T_mix' = T_fluid - T_mix;  T_mix replaces T_fluid in every wet term of the model

t_sump in s: C/UA of the fluid on the machine, 0.3 to 6 h. Source: heat balance of a stirred volume.
Limits: settled at the first instant; heat that comes back from the bodies is not part of it.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_sump",
    title="Fluid remembers",
    group="cutting fluid",
    place="fluid terms",
    formula="lag(fluid, t_sump)",
    amplitude=Amplitude("mixed", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_sump", "s", 4000.0, factor=2.5),),
    signature="every wet body follows a smoothed fluid temperature",
    confused_with=("fluid_delay",),
    source="heat balance of the fluid on the machine: C/UA of channels and bed from 0.3 to 6 h",
    examples=(Example({"fluid": 26.0, "t_sump": 2700.0}, 24.53, {"fluid": 22.0}, 2700.0),),
)
