"""Heat that an internal cooling circuit carries off and the model leaves out at this body.

    q = h_c (T_cool - T)    [W]

h_c in W/K: 500 to 3000 W/m2K of a channel with turbulent water times its wall, 10 to 150 W/K for the
jacket of a drive. Source: Dittus, Boelter 1930, Nu = 0.023 Re^0.8 Pr^0.4. Limits: one coefficient, the
flow is taken as constant; needs the temperature of the coolant, where its power is recorded instead a
share of that is the usual term. Where the model cools this body already a refit absorbs it.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="coolant_convection",
    title="Cooling by the coolant circuit",
    group="drive and cooling",
    place="body",
    formula="h_c*(coolant - body)",
    amplitude=Amplitude("h_c", "W/K", 40.0),
    signature="the body follows the temperature of the coolant",
    confused_with=(
        "air_convection",
        "bed_memory",
    ),
    source="Dittus, Boelter 1930: turbulent flow in a channel, 500 to 3000 W/m2K",
    examples=(Example({"h_c": 40.0, "coolant": 21.0, "body": 27.0}, -240.0),),
)
