"""A jet that wets less since some recording, where no channel says so: it was moved, or its nozzle clogs.

    q = -share q_fluid    [W], from a recording on; or -k share q_fluid in the k-th one after the first

q_fluid is what the fluid brings in the model; share: 1 where the jet misses the body altogether. Source: as
`displaced_jet_missed`, with the place of the nozzle unknown. Limits: never inside a recording; what all
recordings share is the model's own parameter.
"""

from discovery.effects.form import ALL, Amplitude, Effect, Example

EFFECT = Effect(
    word="displaced_jet",
    title="A jet that wets less",
    group="cutting fluid",
    place="fluid terms",
    formula="-share*term",
    amplitude=Amplitude("share", "1", 0.5, most=ALL),
    signature="wet bodies follow the fluid less from a recording on, or in each recording",
    confused_with=("fluid_convection_flow", "wear"),
    source="Liu, Lienhard, Lombara 1991: the heat flow of a jet follows the fluid that feeds it",
    acts="as parts age",
    unless=("nozzle side",),
    examples=(Example({"share": 0.7, "term": 80.0}, -56.0),),
)
