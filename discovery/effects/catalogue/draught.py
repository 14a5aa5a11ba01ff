"""A body loses more to the air during a span of one recording.

    q = G_d (T_air - T) while t_on <= time < t_off    [W]

G_d in W/K, 1 to 20: a door or gate that is open, a fan that somebody placed there. Source: ISO 230-3:2020
asks for protection from draughts; forced against free convection, 10 to 50 against 2 to 10 W/(m2 K). Limits:
constant within its window; what a cover keeps in is `unmeasured_heat`; what comes again and again has a cause
to look for, and the verdict is `unexplained`.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="draught",
    title="Draught for a time",
    group="air and structure",
    place="body",
    formula="G_d*(ambient - body)*where(time >= t_on, 1, 0)*where(time < t_off, 1, 0)",
    amplitude=Amplitude("G_d", "W/K", 5.0),
    shapes=(Shape("t_on", "s", 0.0, instant=True), Shape("t_off", "s", 1e9, instant=True)),
    signature="a body comes closer to the air for some hours of one recording, unrelated to any input",
    confused_with=("unmeasured_heat", "sensor_offset"),
    source="VDI Heat Atlas, F and G: forced convection of 10 to 50 W/(m2 K), free convection of 2 to 10",
    search="window",
    acts="in one recording",
    shared=True,
    examples=(
        Example(
            {"G_d": 5.0, "ambient": 22.0, "body": 30.0, "time": 5000.0, "t_on": 3600.0, "t_off": 7200.0},
            -40.0,
        ),
    ),
)
