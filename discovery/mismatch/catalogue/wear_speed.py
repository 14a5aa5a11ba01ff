"""Losses that changed between two recordings, of a machine whose drive power nobody recorded.

    q = P_wear (n/1000)^m in one recording    [W]

P_wear in W at 1000 rpm, of either sign: a fifth of what `friction_speed` is; m of 1 to 2.5 as there.
Source: as `wear`. Limits: as `wear`; only where the model reckons losses from the speed alone, since of a
recorded power another share is the plainer law; a power of the speed, whatever the law of the model.
"""

from dataclasses import replace

from discovery.mismatch.catalogue import friction_speed, wear
from discovery.mismatch.catalogue.effect import Amplitude, Example

EFFECT = replace(
    wear.EFFECT,
    title="Friction that ages, by the speed",
    place="speed-driven body",
    formula="P_wear*(speed/1000)**m",
    amplitude=Amplitude("P_wear", "W", 30.0, 0),
    shapes=friction_speed.EFFECT.shapes,
    signature="heat that follows the speed differs between recordings",
    examples=(Example({"P_wear": -40.0, "speed": 500.0, "m": 2.0}, -10.0),),
)
