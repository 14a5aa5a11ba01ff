"""A jet that hits another place: what it no longer wets.

    q = -share s/s_max q_fluid    [W]

q_fluid is what the fluid brings in the model; s: where the jet points, a recorded input of role `nozzle
side`, zero where the model was made for; share at the largest side that was recorded, 1 where the jet misses
the body altogether. Source: heat flow of a film in proportion to the fluid that feeds it (Newton's law of
cooling; Liu, Lienhard, Lombara, J. Heat Transfer 113, 1991). Limits: in proportion to the side; what the jet
hits instead is a law of its own (`displaced_jet`).
"""

from discovery.effects.form import ALL, Amplitude, Effect, Example

EFFECT = Effect(
    word="displaced_jet",
    title="A jet that misses what it wetted",
    group="cutting fluid",
    place="fluid terms",
    formula="-share*level*term",
    amplitude=Amplitude("share", "1", 0.5, most=ALL),
    signature="wet bodies follow the fluid less while the nozzle points aside",
    confused_with=("fluid_convection_flow", "rim_detachment", "input_exchange"),
    source="Liu, Lienhard, Lombara 1991: the heat flow of a jet follows the fluid that feeds it",
    roles=("nozzle side",),
    examples=(Example({"share": 0.7, "level": 1.0, "term": 80.0}, -56.0),),
)
