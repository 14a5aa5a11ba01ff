"""Bearing and seal friction as a function of speed, beyond the share of the drive power in the model.

    q = P_f (n/1000)^m_loss    [W]

P_f in W at 1000 rpm, 20 to 400; m_loss of 1 to 2.5. Source: Palmgren (M_c + M_v n^(2/3)) n, seals n^2.
At any body: a bearing or a seal may stand where the model has no drive loss; several driven bodies may share
one law. Limits: one power law for both parts; with measured drive power as an input most of it is inside the
model already.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="friction_speed",
    title="Friction that follows the speed",
    group="drive and cooling",
    place="body",
    formula="P_f*(speed/1000)**m_loss",
    amplitude=Amplitude("P_f", "W", 150.0),
    shapes=(Shape("m_loss", "1", 1.6, factor=1.4),),
    signature=(
        "heat in bearings and drive that the drive power does not account for, a smooth power of the speed"
    ),
    confused_with=(
        "viscosity_temperature",
        "windage",
        "film_drag",
    ),
    source="Palmgren: (M_c + M_v n^(2/3)) n, viscous seals n^2: an effective exponent of 1 to 2",
    shared=True,
    examples=(Example({"P_f": 50.0, "speed": 500.0, "m_loss": 1.0}, 25.0),),
)
