"""Convection to the air that grows with the speed of the table.

    q = hR_air (n/1000)^m_air (T_env - T)    [W]

hR_air in W/K at 1000 rpm, 2 to 20: 5 to 47 W/m2K from standstill to 1200 rpm; m_air of 0.5 laminar to 0.8
turbulent (Re > 2.4e5, about 570 rpm). Source: rotating disk, Nu = 0.36 Re^0.5. Limits: one exponent
across the transition.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="rotating_air_convection",
    title="Air moved by rotation",
    group="air and structure",
    place="body",
    formula="hR_air*(speed/1000)**m_air*(ambient - body)",
    amplitude=Amplitude("hR_air", "W/K", 8.0),
    shapes=(Shape("m_air", "1", 0.7, factor=1.4),),
    signature="heat loss to the air that grows with speed, wet or dry",
    confused_with=(
        "air_convection",
        "natural_convection",
    ),
    source="rotating disk: Nu = 0.36 Re^0.5 laminar, Re^0.8 turbulent; 5 to 47 W/m2K up to 1200 rpm",
    examples=(Example({"hR_air": 8.0, "speed": 1000.0, "m_air": 0.5, "ambient": 22.0, "body": 27.0}, -40.0),),
)
