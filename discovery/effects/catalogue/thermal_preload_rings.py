"""A shaft warmer than its housing tightens the bearing between them: friction grows with the difference.

    q = P_k n/1000 (T - T_other)    [W], into the first body alone

P_k in W/K at 1000 rpm, 1 to 10: 1 to 5 % of the friction torque per kelvin between the rings. Source:
bearing preload study, Lubricants 12:185. Limits: the rings have the mean temperatures of two bodies.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="thermal_preload",
    title="Preload grows with heat between the rings",
    group="drive and cooling",
    place="driven and another",
    formula="P_k*speed/1000*(body - other)",
    amplitude=Amplitude("P_k", "W/K", 4.0),
    signature="power rises while the shaft warms before its housing, opposite to oil viscosity",
    confused_with=("viscosity_temperature",),
    source="bearing preload study: friction torque rises 1 to 5 % per kelvin between inner and outer ring",
    examples=(Example({"P_k": 2.0, "speed": 1000.0, "body": 27.0, "other": 24.0}, 6.0),),
)
