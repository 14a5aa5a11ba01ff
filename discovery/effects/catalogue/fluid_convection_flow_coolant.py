"""The coupling to a coolant circuit does not follow its flow as the model says: with a power of it.

    q = ((Q/Q_max)^m - 1) q_coolant    [W]

q_coolant is what the coolant brings in the model; Q: a recorded flow; m: what is missing in the exponent, 0.8
where the model does not know the flow, -0.6 to -0.2 where it counts in proportion. Source: Dittus, Boelter
1930: Nu = 0.023 Re^0.8 Pr^0.4, and less where the wall is far from the channel. Limits: seen only where the
flow takes more than two levels.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_convection_flow",
    title="Cooling that follows the flow of the coolant",
    group="cutting fluid",
    place="coolant terms",
    formula="by_flow*(max(rate, 0.02)**m_flow - 1)*term",
    amplitude=Amplitude("by_flow", "1", 1.0, 1, 1.0),
    shapes=(Shape("m_flow", "1", 0.0, spread=0.5),),
    signature="the coupling of bodies to the coolant changes otherwise than modelled when the flow steps",
    confused_with=("coolant_convection",),
    source="Dittus, Boelter 1930: Nu = 0.023 Re^0.8 Pr^0.4 of turbulent flow in a channel",
    examples=(
        Example({"by_flow": 1.0, "rate": 0.25, "m_flow": 0.5, "term": 80.0}, -40.0),
        Example({"by_flow": 1.0, "rate": 0.25, "m_flow": -0.5, "term": 80.0}, 80.0),
    ),
)
