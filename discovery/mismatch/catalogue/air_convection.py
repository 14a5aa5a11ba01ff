"""Heat exchange with the air that the model leaves out at this body."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="air_convection",
    title="Convection to the air",
    group="air and structure",
    place="body",
    formula="hA*(ambient - body)",
    amplitude=Amplitude("hA", "W/K", 6.0),
    signature="the body follows the room",
    confused_with=(
        "radiation",
        "bed_memory",
    ),
    source="Newton's law of cooling, free air 5 to 25 W/m2K",
    examples=(Example({"hA": 6.0, "ambient": 20.0, "body": 25.0}, -30.0),),
)
