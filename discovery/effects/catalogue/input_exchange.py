"""A recorded input changes the exchange of a body with the air: a fan, a door, a damper.

    q = G_in u/u_max (T_env - T)    [W]

u: a recorded input whose law has no name of its own; G_in in W/K at the largest value that was recorded, of
either sign. Source: Nusselt numbers of forced convection, 10 to 100 W/m2K of a fan against 5 of still air
(VDI Heat Atlas, G). Limits: in proportion to the input.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="input_exchange",
    title="A recorded input changes the loss to the air",
    group="inputs",
    place="body",
    formula="G_in*level*(ambient - body)",
    amplitude=Amplitude("G_in", "W/K", 6.0, 0),
    signature="the body comes closer to the room, or less so, while a recorded input is on",
    confused_with=("input_heat", "rotating_air_convection"),
    source="VDI Heat Atlas, part G: forced convection of 10 to 100 W/m2K against 5 W/m2K of still air",
    roles=("other input", "nozzle height", "fluid flow"),
    examples=(Example({"G_in": 6.0, "level": 0.5, "ambient": 20.0, "body": 30.0}, -30.0),),
)
