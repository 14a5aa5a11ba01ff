"""Swarf heats the body on which it lands, in proportion to a recorded cutting power."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="swarf_heat",
    title="Heat of hot swarf",
    group="cutting fluid",
    place="body",
    formula="swarf*other_input",
    amplitude=Amplitude("swarf", "1", 0.1),
    signature="heat pulses that follow the cutting power",
    confused_with=("unmeasured_heat",),
    source="100 cm3/min of steel take 4.2 kW, of which 5 to 15 % stay on table and fluid",
    examples=(Example({"swarf": 0.1, "other_input": 4000.0}, 400.0),),
)
