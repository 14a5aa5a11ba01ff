"""The film is thrown off the rim, so that a wet body loses its coupling at speed.

    q = -hR flow n^2/(n_c^2 + n^2) (T_fluid - T)    [W]

hR in W/K, at most the wet coupling of the body in the model; n_c of 100 to 250 rpm (w^2 r exceeds g from
about 60 rpm). Source: centrifugal detachment. Limits: needs a wet body in the model, opposite in sign to
the film law.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="rim_detachment",
    title="Film leaves the rim",
    group="cutting fluid",
    place="wet body",
    formula="-hR*flow*speed**2/(n_c**2 + speed**2)*(fluid - body)",
    amplitude=Amplitude("hR", "W/K", 30.0),
    shapes=(Shape("n_c", "rpm", 170.0, factor=1.7),),
    signature="the wet coupling falls with speed, the opposite of the film law",
    confused_with=("fluid_convection_speed",),
    source="centrifugal detachment: w^2 r exceeds g from about 60 rpm; critical speeds of 100 to 250 rpm",
    shared=True,
    examples=(
        Example({"hR": 30.0, "flow": 1.0, "speed": 120.0, "n_c": 120.0, "fluid": 26.0, "body": 22.0}, -60.0),
    ),
)
