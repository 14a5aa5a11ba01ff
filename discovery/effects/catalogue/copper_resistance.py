"""Copper losses grow with the winding temperature.

    q = R_cu 0.00393 P (T - 22)    [W]

R_cu: copper share of the drive power, 0 to 1. Source: temperature coefficient of copper, 0.00393/K at 20
degC. Limits: the winding is as warm as the body; almost always invisible (4 % of the copper losses per 10
K).
"""

from discovery.effects.form import ALL, Amplitude, Effect, Example

EFFECT = Effect(
    word="copper_resistance",
    title="Copper resistance",
    group="drive and cooling",
    place="driven body",
    formula="R_cu*0.00393*load*(body - 22)",
    amplitude=Amplitude("R_cu", "1", 0.3, most=ALL),
    signature="drive losses grow 4 % per 10 K; almost always invisible",
    confused_with=("thermal_preload",),
    source="temperature coefficient of copper 0.00393/K on the copper share of the drive losses",
    examples=(Example({"R_cu": 0.5, "load": 1000.0, "body": 32.0}, 19.65),),
)
