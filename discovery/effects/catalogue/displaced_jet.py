"""A jet that hits another place: what it wets there.

    q = G_jet s/s_max flow (T_fluid - T)    [W]

s: where the jet points, a recorded input of role `nozzle side`, zero where the model was made for; G_jet in
W/K at the largest side that was recorded and flow 1: 5 to 30 on structure that is splashed, up to some
hundred under the jet itself. Source: Newton's law of cooling; Liu, Lienhard, Lombara, J. Heat Transfer 113,
1991: a wall jet cools what lies inside its hydraulic jump, 0.1 to 0.2 m around the point that it hits.
Splash reaches the neighbours: two linked bodies may be wet at once, each with a G_jet of its own. Limits: in
proportion to side and flow; only bodies that the model leaves dry, because what the jet wetted before changes
by a law of its own (`displaced_jet_missed`).
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="displaced_jet",
    title="A jet that hits another place",
    group="cutting fluid",
    place="fluid-free body",
    formula="G_jet*level*flow*(fluid - body)",
    amplitude=Amplitude("G_jet", "W/K", 20.0),
    signature="a body follows the fluid while the nozzle points aside, and only then",
    confused_with=("fluid_convection", "input_exchange", "input_heat"),
    source="Liu, Lienhard, Lombara 1991: a jet cools what lies inside its hydraulic jump",
    spreads=True,
    roles=("nozzle side",),
    examples=(Example({"G_jet": 20.0, "level": 0.5, "flow": 1.0, "fluid": 27.0, "body": 22.0}, 50.0),),
)
