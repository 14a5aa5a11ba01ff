"""Air drag of the rotating parts: a few watts.

    q = P_w (n/1000)^2.8    [W]

P_w in W at 1000 rpm, 2 to 20: 2 W at 600 rpm, 12 W at 1200 rpm. Source: von Karman disk. Limits: at
realistic size nearly always below detection, hence the small prior; `friction_speed` follows it closely.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="windage",
    title="Windage",
    group="drive and cooling",
    place="driven body",
    formula="P_w*(speed/1000)**2.8",
    amplitude=Amplitude("P_w", "W", 8.0),
    signature="heat with nearly the cube of the speed, some watts",
    confused_with=("friction_speed",),
    source="von Karman disk: power with speed to the 2.8; 2 W at 600 rpm, 12 W at 1200 rpm",
    examples=(Example({"P_w": 8.0, "speed": 1000.0}, 8.0),),
)
