"""A winding that is heated by a recorded current: its resistance grows with its temperature.

    q = R_cu 0.00393 (T - 22) q_I    [W]

q_I is what the current makes flow in the model at 22 degC, R_cu the share of it that is lost in copper, 0 to
1. Source: temperature coefficient of copper, 0.00393/K at 20 degC. Limits: the winding is as warm as the
body.
"""

from discovery.effects.form import ALL, Amplitude, Effect, Example

EFFECT = Effect(
    word="copper_resistance",
    title="Copper resistance of a winding",
    group="drive and cooling",
    place="current terms",
    formula="R_cu*0.00393*(body - 22)*term",
    amplitude=Amplitude("R_cu", "1", 0.8, most=ALL),
    signature="the heat of a current grows 4 % per 10 K of the winding",
    confused_with=("input_exchange", "input_heat"),
    source="temperature coefficient of copper 0.00393/K on the copper share of the losses of a current",
    examples=(Example({"R_cu": 0.5, "term": 1000.0, "body": 32.0}, 19.65),),
)
