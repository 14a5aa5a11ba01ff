"""The coupling to the fluid does not follow its flow as the model says: with a power of it.

    q = ((Q/Q_max)^m - 1) q_fluid    [W]

q_fluid is what the fluid brings in the model; Q: a recorded flow; m: what is missing in the exponent, 0.5 to
0.8 where the model does not know the flow, -0.5 to -0.2 where it counts in proportion. Source: Liu, Lienhard,
Lombara, J. Heat Transfer 113, 1991: Nusselt numbers of jets and films follow the flow with 0.5 to 0.8.
Limits: seen only where the flow takes more than two levels; with a pump that is on or off it changes nothing.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_convection_flow",
    title="Convection that follows the flow",
    group="cutting fluid",
    place="fluid terms",
    formula="by_flow*(max(rate, 0.02)**m_flow - 1)*term",
    amplitude=Amplitude("by_flow", "1", 1.0, 1, 1.0),
    shapes=(Shape("m_flow", "1", 0.0, spread=0.5),),
    signature="the coupling of wet bodies to the fluid changes otherwise than modelled when the flow steps",
    confused_with=("fluid_convection",),
    source="Liu, Lienhard, Lombara 1991: Nusselt numbers of jets and films follow the flow with 0.5 to 0.8",
    examples=(
        Example({"by_flow": 1.0, "rate": 0.25, "m_flow": 0.5, "term": 80.0}, -40.0),
        Example({"by_flow": 1.0, "rate": 0.25, "m_flow": -0.5, "term": 80.0}, 80.0),
    ),
)
