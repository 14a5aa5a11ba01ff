"""Something hot or cold comes to a body at an instant of one recording, and becomes as warm as it.

    q = q_p exp(-(time - t_in)/t_p) from t_in on    [W]

q_p in W, of either sign, 20 to 2000; t_p: minutes for a cold fluid that is filled in, 10 to 60 min for a
workpiece or a pallet that is clamped. Source: heat balance of a mass that is brought in, q_p = G (T - T_body)
at first and t_p = C/G. Limits: what comes in adds no mass to the body; one instant per body and recording in
the search.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="heat_pulse",
    title="Something hot or cold that is brought in",
    group="air and structure",
    place="body",
    formula="q_p*(where(time >= t_in, 1, 0) - lag(where(time >= t_in, 1, 0), t_p))",
    amplitude=Amplitude("q_p", "W", 60.0, 0),
    shapes=(Shape("t_in", "s", 0.0, instant=True), Shape("t_p", "s", 600.0, factor=3.0, or_at_once=True)),
    signature="a body becomes warmer or colder within minutes, unrelated to any input, and comes back slowly",
    confused_with=("sensor_offset", "unmeasured_heat"),
    source="heat balance of a mass that is brought in: a cold fluid, a workpiece, a pallet",
    search="step",
    acts="in one recording",
    examples=(
        Example({"q_p": 100.0, "time": 5000.0, "t_in": 3600.0, "t_p": 600.0}, 0.0),
        # one time constant after it came
        Example({"q_p": 100.0, "time": 4200.0, "t_in": 4000.0, "t_p": 600.0}, 36.79, {"time": 3600.0}, 600.0),
    ),
)
