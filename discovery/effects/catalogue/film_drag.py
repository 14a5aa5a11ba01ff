"""The table accelerates the film; half of the power heats it, half is dissipated where it lands.

    q = q_d flow (n/1000)^m_drag    [W]

q_d in W at 1000 rpm, 20 to 200; m_drag near 2. Source: momentum balance P = m_drag' (w r)^2: 41 to 82 W at
600 rpm and 164 to 327 W at 1200 rpm for 10 to 20 l/min. Limits: all of the share lands on one body; the
fluid's own warming is measured.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="film_drag",
    title="Drag of the film",
    group="cutting fluid",
    place="body",
    formula="q_d*flow*(speed/1000)**m_drag",
    amplitude=Amplitude("q_d", "W", 150.0),
    shapes=(Shape("m_drag", "1", 2.0, factor=1.15),),
    signature="heat with the square of the speed, only while the pump runs",
    confused_with=("friction_speed",),
    source=(
        "momentum balance: P = m_drag'(w r)^2, 41 to 82 W at 600 rpm, 164 to 327 W at 1200 rpm "
        "for 10 to 20 l/min"
    ),
    examples=(Example({"q_d": 80.0, "flow": 1.0, "speed": 500.0, "m_drag": 2.0}, 20.0),),
)
