"""Heat at a body during a span of one recording that no channel explains.

    q = q_u while t_on <= time < t_off    [W]

q_u in W, positive: sun 75 to 200 W on one side, heaters, an axis under load. Source: ISO 230-3
(environment). Limits: constant within its window; what cools a body does so by an exchange with something
colder, in proportion to the difference, and is no such heat; when heat is needed again and again there is a
cause to look for, and the verdict is `unexplained`.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="unmeasured_heat",
    title="Heat that nothing records",
    group="air and structure",
    place="body",
    formula="q_u*where(time >= t_on, 1, 0)*where(time < t_off, 1, 0)",
    amplitude=Amplitude("q_u", "W", 60.0),
    shapes=(Shape("t_on", "s", 0.0, instant=True), Shape("t_off", "s", 1e9, instant=True)),
    signature="a pulse of heat in one recording, unrelated to any input",
    confused_with=("sensor_offset",),
    source="sun 75 to 200 W on one side, heaters, an axis under load",
    search="window",
    acts="in one recording",
    examples=(Example({"q_u": 80.0, "time": 5000.0, "t_on": 3600.0, "t_off": 7200.0}, 80.0),),
)
