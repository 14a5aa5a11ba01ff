"""Wet coupling that grows with the speed of the table.

    q = hN flow (n/1000)^m_film (T_fluid - T)    [W]

hN in W/K at 1000 rpm, 5 to 100; m_film of 0.1 (eq. (1) of the paper) to 1. Source: film on a rotating disk.
Limits: the law of a well wetted table is nearly invisible, on weakly coupled bodies it is not; zero at
standstill, so that `fluid_convection` can act together with it.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_convection_speed",
    title="Convection that follows the speed",
    group="cutting fluid",
    place="wet body",
    formula="hN*flow*(speed/1000)**m_film*(fluid - body)",
    amplitude=Amplitude("hN", "W/K", 40.0),
    shapes=(Shape("m_film", "1", 0.35, factor=2.3),),
    signature="wet coupling grows with speed; fast after a speed step while fluid and body differ",
    confused_with=(
        "fluid_convection",
        "film_drag",
    ),
    source="film on a rotating disk: coefficient grows with speed, exponents 0.1 (eq. 1 of the paper) to 1",
    examples=(
        Example({"hN": 30.0, "flow": 1.0, "speed": 500.0, "m_film": 1.0, "fluid": 26.0, "body": 22.0}, 60.0),
    ),
)
