"""Wet coupling that grows with the speed of the table.

The h-law of a well wetted table is nearly invisible; on weakly coupled bodies it is not.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_convection_speed",
    title="Convection that follows the speed",
    group="cutting fluid",
    place="body",
    formula="hN*flow*(speed/1000)**m*(fluid - body)",
    amplitude=Amplitude("hN", "W/K", 40.0),
    shapes=(Shape("m", "1", (0.5, 1.0), 0.3, 1.5),),
    signature="wet coupling grows with speed; fast after a speed step while fluid and body differ",
    confused_with=(
        "fluid_convection",
        "film_drag",
    ),
    source="film on a rotating disk: coefficient grows with speed, exponents 0.1 (eq. 1 of the paper) to 1",
    examples=(
        Example({"hN": 30.0, "flow": 1.0, "speed": 500.0, "m": 1.0, "fluid": 26.0, "body": 22.0}, 60.0),
    ),
)
