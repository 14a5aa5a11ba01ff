"""Free convection: a film coefficient that grows with the temperature difference.

    q = h_nat |T_env - T|^0.3 (T_env - T)    [W]

h_nat in W/K^1.3 (W/K at 1 K), 1 to 15: 1.9 W/m2K at 1 K and 4.2 W/m2K at 10 K. Source: Churchill-Chu, McAdams
(exponents 1/4 laminar to 1/3 turbulent, 0.3 between them). Limits: only what differs from a linear loss
is seen; beside `radiation` it is rarely decidable.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="natural_convection",
    title="Natural convection",
    group="air and structure",
    place="air body",
    formula="h_nat*abs(ambient - body)**0.3*(ambient - body)",
    amplitude=Amplitude("h_nat", "W/K**1.3", 4.0),
    signature="loss to the air grows faster than the temperature difference: slower tail near equilibrium",
    confused_with=(
        "radiation",
        "air_convection",
    ),
    source=(
        "Churchill-Chu, McAdams: h grows with the 1/4 to 1/3 power of the temperature difference, 1.9 "
        "to 4.2 W/m2K for 1 to 10 K"
    ),
    examples=(Example({"h_nat": 4.0, "ambient": 22.0, "body": 23.0}, -4.0),),
)
