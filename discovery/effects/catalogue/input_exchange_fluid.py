"""A recorded input changes the exchange of a body with the cutting fluid: a second nozzle, a flush, a shield.

    q = G_in u/u_max (T_fluid - T)    [W]

u: a recorded input whose law has no name of its own; G_in in W/K at the largest value that was recorded, of
either sign. Source: Liu, Lienhard, Lombara, J. Heat Transfer 113, 1991: Nusselt numbers of jets and films
follow the flow. Limits: in proportion to the input.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_exchange",
    title="A recorded input changes the exchange with the fluid",
    group="inputs",
    place="body",
    formula="G_in*level*(fluid - body)",
    amplitude=Amplitude("G_in", "W/K", 20.0, 0),
    signature="the body comes closer to the fluid, or less so, while a recorded input is on",
    confused_with=("input_heat", "fluid_convection"),
    source="Liu, Lienhard, Lombara 1991: Nusselt numbers of jets and films follow the flow",
    roles=("other input", "nozzle height", "fluid flow"),
    examples=(Example({"G_in": 20.0, "level": 0.5, "fluid": 20.0, "body": 26.0}, -60.0),),
)
