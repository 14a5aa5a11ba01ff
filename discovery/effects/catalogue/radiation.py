"""Thermal radiation to the room with an effective (emissivity times) area.

    q = A_rad 5.67e-8 ((T_env + 273.15)^4 - (T + 273.15)^4)    [W]

A_rad in m2, 0.1 to 2. Source: Stefan-Boltzmann, 0.6 to 5.3 W/m2K for emissivities of 0.1 to 0.9 at room
temperature. Limits: walls as warm as the air; over 10 K only 5 % of it differ from a linear loss, which a
refit absorbs, so it takes bodies tens of kelvin above the room.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="radiation",
    title="Radiation",
    group="air and structure",
    place="air body",
    formula="A_rad*5.67e-8*((ambient + 273.15)**4 - (body + 273.15)**4)",
    amplitude=Amplitude("A_rad", "m**2", 1.0),
    signature=(
        "loss to the surroundings with the fourth power; invisible unless the body is tens of kelvin "
        "above the room"
    ),
    confused_with=(
        "natural_convection",
        "air_convection",
    ),
    source="Stefan-Boltzmann; over 10 K only 5 % of it differ from a linear loss",
    shared=True,
    examples=(Example({"A_rad": 1.0, "ambient": 20.0, "body": 30.0}, -60.13),),
)
