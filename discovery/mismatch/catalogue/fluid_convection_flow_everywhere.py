"""Film coefficients of all wet bodies follow the flow with an exponent below one.

    flow^m stands for flow in every wet term of the model

m of 0.5 to 0.8. Source: Liu, Lienhard 1991, Nusselt numbers of jets and films. Limits: seen only where the
flow takes more than two levels; with a pump that is on or off it changes nothing, and so is never named.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_convection_flow",
    title="Convection everywhere follows the flow",
    group="cutting fluid",
    place="fluid terms",
    formula="flow**m",
    amplitude=Amplitude("on", "1", 1.0, 1, 1.0),
    shapes=(Shape("m", "1", (0.5, 0.8), 0.2, 1.0),),
    signature="the coupling of all wet bodies to the fluid changes less than the flow when the flow steps",
    confused_with=("fluid_convection",),
    source=(
        "Liu, Lienhard 1991: Nusselt number of jets and films follows the flow with an exponent of 0.5 to 0.8"
    ),
    examples=(Example({"flow": 0.25, "m": 0.5}, 0.5),),
)
