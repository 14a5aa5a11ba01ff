"""A jet that somebody moved between two recordings, where no channel says so: what it wets since.

    q = G_jet flow (T_fluid - T)    [W], from a recording on

G_jet in W/K at flow 1: 5 to 30 on structure that is splashed, up to some hundred under the jet itself.
Source: as `displaced_jet`, with the place of the nozzle unknown. Limits: a step between recordings, in the
order of their dates, never inside one.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="displaced_jet",
    title="A jet that was moved to another place",
    group="cutting fluid",
    place="fluid-free body",
    formula="G_jet*flow*(fluid - body)",
    amplitude=Amplitude("G_jet", "W/K", 20.0),
    signature="a body follows the fluid from a recording on, and not before",
    confused_with=("fluid_convection", "wear"),
    source="Liu, Lienhard, Lombara 1991: a jet cools what lies inside its hydraulic jump",
    acts="from a recording on",
    spreads=True,
    unless=("nozzle side",),
    examples=(Example({"G_jet": 20.0, "flow": 1.0, "fluid": 27.0, "body": 22.0}, 100.0),),
)
