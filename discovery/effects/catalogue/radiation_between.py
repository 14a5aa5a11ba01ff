"""Thermal radiation between two bodies that the model links, with an effective (emissivity times) area.

    q = A_rad 5.67e-8 ((T_other + 273.15)^4 - (T + 273.15)^4)    [W] into one body and out of the other

A_rad in m2, 0.1 to 2. Source: Stefan-Boltzmann, exchange of two grey surfaces, A/(1/e1 + 1/e2 - 1) where they
are close. Limits: near one temperature it is conduction, which the link of the model absorbs; it takes a body
tens of kelvin above the other, at several levels. Bodies without a link get a path of conduction first.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="radiation",
    title="Radiation from one body to another",
    group="air and structure",
    place="link",
    formula="A_rad*5.67e-8*((other + 273.15)**4 - (body + 273.15)**4)",
    amplitude=Amplitude("A_rad", "m**2", 1.0),
    signature="a link between two bodies gets better with the third power of their temperature in kelvin",
    confused_with=(
        "contact_conductance",
        "conduction_path",
    ),
    source="Stefan-Boltzmann; Incropera, Fundamentals of Heat and Mass Transfer, exchange of grey surfaces",
    examples=(Example({"A_rad": 1.0, "other": 200.0, "body": 30.0}, 2363.0),),
)
