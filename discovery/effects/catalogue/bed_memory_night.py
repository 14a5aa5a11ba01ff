"""The bed comes out of a night or a weekend with another temperature than the room, and forgets it over days.

    t_bed T_bed' = T_env - T_bed,  T_bed(0) = T_env(0) + dT_0,   q = G_bed (T_bed - T)    [W]

G_bed in W/K, 2 to 20; t_bed of 20 to 60 h; dT_0 of -6 to 6 K, the same in all recordings. Source: Bryan's
thermal memory; the bed as one follower of the room. Limits: recordings that begin after different nights
have no common dT_0.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="bed_memory",
    title="Memory of the bed, from a cold or warm start",
    group="air and structure",
    place="body",
    formula="G_bed*(lag(ambient, t_bed) + dT_0*exp(-time/t_bed) - body)",
    amplitude=Amplitude("G_bed", "W/K", 8.0),
    shapes=(Shape("t_bed", "s", 120000.0, factor=1.6), Shape("dT_0", "K", 0.0, spread=3.0)),
    signature="a drift over the first day, in the same direction in every recording",
    confused_with=(
        "sensor_drift",
        "air_convection",
    ),
    source="machine bed as a first-order follower of the room, 20 to 60 h (Bryan's thermal memory)",
    examples=(
        Example(
            {"G_bed": 8.0, "ambient": 23.0, "t_bed": 36000.0, "body": 23.0, "dT_0": -3.0, "time": 36000.0},
            -8.829,
        ),
    ),
)
