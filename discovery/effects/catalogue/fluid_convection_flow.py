"""Film coefficient that follows the flow with an exponent below one.

    q = hQ (flow^m - flow) (T_fluid - T)    [W]

hQ in W/K, of either sign, m of 0.5 to 0.8; what it adds to the proportional coupling that the model has.
Source: Liu, Lienhard 1991, Nusselt numbers of jets and films. Limits: seen only where the flow takes more
than two levels; with a pump that is on or off it is zero, and so never named.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_convection_flow",
    title="Convection that follows the flow",
    group="cutting fluid",
    place="wet body",
    formula="hQ*(flow**m - flow)*(fluid - body)",
    amplitude=Amplitude("hQ", "W/K", 40.0, 0),
    shapes=(Shape("m", "1", (0.5, 0.8), 0.2, 1.0),),
    signature="the coupling to the fluid changes less than the flow when the flow steps",
    confused_with=("fluid_convection",),
    source=(
        "Liu, Lienhard 1991: Nusselt number of jets and films follows the flow with an exponent of 0.5 to 0.8"
    ),
    examples=(Example({"hQ": 40.0, "flow": 4.0, "m": 0.5, "fluid": 24.0, "body": 22.0}, -160.0),),
)
