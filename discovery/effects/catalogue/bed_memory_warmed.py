"""The bed follows the room over days and is warmed by the body as well.

    C_bed T_bed' = G_bed (T - T_bed) + G_air (T_env - T_bed),   q = G_bed (T_bed - T)    [W]

As the formula has it: t_bed = C_bed/(G_bed + G_air) and r_bed = G_air/G_bed. Without G_air the bed is a
second thermal mass; with a large one it follows the room alone. G_bed in W/K, 2 to 50; t_bed of 5 to 50 h;
r_bed of 0.3 to 4. Source: Bryan's thermal memory; energy balance of one mass between body and room. Limits:
settled at the first instant; a recording shorter than t_bed hardly shows r_bed.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="bed_memory",
    title="Memory of a bed that the body warms",
    group="air and structure",
    place="body",
    formula="G_bed*(lag((body + r_bed*ambient)/(1 + r_bed), t_bed) - body)",
    amplitude=Amplitude("G_bed", "W/K", 8.0),
    shapes=(Shape("t_bed", "s", 60000.0, factor=1.8), Shape("r_bed", "", 1.0, factor=2.0)),
    signature="a drift over the first day, related to the room of yesterday and to the heat of the body",
    confused_with=(
        "second_thermal_mass",
        "sensor_drift",
        "air_convection",
    ),
    source="a machine bed between body and room: C T' = G_bed (T_body - T) + G_air (T_env - T)",
    examples=(
        Example(
            {"G_bed": 8.0, "ambient": 23.0, "t_bed": 36000.0, "body": 22.0, "r_bed": 1.0},
            -8.620,
            {"ambient": 20.0, "body": 20.0},
            16577.0,
        ),
    ),
)
