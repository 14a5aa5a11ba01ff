"""The body exchanges heat with a bed that follows the room over days.

    t_bed T_bed' = T_env - T_bed,   q = G_bed (T_bed - T)    [W]

G_bed in W/K, 2 to 20; t_bed of 20 to 60 h. Source: Bryan's thermal memory; the bed as one follower of the
room. Limits: the bed starts settled in the room of the first instant; a recording shorter than a day
shows little more than a drift, which `sensor_drift` follows as well.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="bed_memory",
    title="Memory of the bed",
    group="air and structure",
    place="body",
    formula="G_bed*(lag(ambient, t_bed) - body)",
    amplitude=Amplitude("G_bed", "W/K", 8.0),
    shapes=(Shape("t_bed", "s", 120000.0, factor=1.6),),
    signature="a drift over the first day, related to the room of yesterday",
    confused_with=(
        "sensor_drift",
        "air_convection",
    ),
    source="machine bed as a first-order follower of the room, 20 to 60 h (Bryan's thermal memory)",
    examples=(
        Example(
            {"G_bed": 8.0, "ambient": 23.0, "t_bed": 36000.0, "body": 20.0}, 8.856, {"ambient": 20.0}, 16577.0
        ),
    ),
)
