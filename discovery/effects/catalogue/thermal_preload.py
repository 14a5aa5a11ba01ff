"""A warm shaft tightens its bearing: friction grows with the temperature rise.

    q = P_k n/1000 (T - T_env)    [W]

P_k in W/K at 1000 rpm, 1 to 10: 1 to 5 % of the friction torque per kelvin between the rings. Source:
bearing preload study, Lubricants 12:185. Limits: the body's rise above the room stands for the difference
between the rings.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="thermal_preload",
    title="Preload grows with heat",
    group="drive and cooling",
    place="driven body",
    formula="P_k*speed/1000*(body - ambient)",
    amplitude=Amplitude("P_k", "W/K", 4.0),
    signature="power rises during warm-up: positive feedback, opposite to oil viscosity",
    confused_with=("viscosity_temperature",),
    source="bearing preload study: friction torque rises 1 to 5 % per kelvin between inner and outer ring",
    examples=(Example({"P_k": 2.0, "speed": 1000.0, "body": 27.0, "ambient": 22.0}, 10.0),),
)
