"""A jet that somebody moved between two recordings, where no channel says so: what it no longer wets.

    q = -share q_fluid    [W], from a recording on

q_fluid is what the fluid brings in the model; share: 1 where the jet misses the body altogether. Source: as
`displaced_jet_missed`, with the place of the nozzle unknown. Limits: a step between recordings, in the order
of their dates, never inside one.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="displaced_jet",
    title="A jet that was moved away",
    group="cutting fluid",
    place="fluid terms",
    formula="-share*term",
    amplitude=Amplitude("share", "1", 0.5, most=1.0),
    signature="wet bodies follow the fluid less from a recording on",
    confused_with=("fluid_convection_flow", "wear"),
    source="Liu, Lienhard, Lombara 1991: the heat flow of a jet follows the fluid that feeds it",
    acts="from a recording on",
    unless=("nozzle side",),
    examples=(Example({"share": 0.7, "term": 80.0}, -56.0),),
)
