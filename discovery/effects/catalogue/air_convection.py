"""Heat exchange with the air that the model leaves out at this body.

    q = hA (T_env - T)    [W]

hA in W/K: 5 to 25 W/m2K of free air times the surface, 1 to 25 W/K for a body of 0.2 to 1 m2. Source:
Newton's law of cooling. Limits: one coefficient for still and moved air; where the model already has a
path to the air at this body, a refit absorbs it and nothing is left to see.
"""

from discovery.effects.form import Amplitude, Effect, Example

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
