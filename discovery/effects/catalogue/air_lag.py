"""The air around the machine follows the air at its sensor late: an enclosure, a dome, a corner of the hall.

    t_air T_air' = T_env - T_air;  T_air replaces T_env in every term of the air in the model

t_air in s: 10 min to 2 h. Source: heat balance of an enclosure: sheet metal, fixtures and air of 50 to 200
kJ/K behind 20 to 100 W/K. Limits: at all bodies or at one; settled at the first instant; heat of the machine
that warms this air is not part of it.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="air_lag",
    title="Air that follows its sensor late",
    group="air and structure",
    place="air terms",
    formula="lag(ambient, t_air)",
    amplitude=Amplitude("enclosed", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_air", "s", 2000.0, factor=2.5),),
    signature="all bodies follow a smoothed room temperature",
    confused_with=("second_thermal_mass", "bed_memory"),
    source="heat balance of an enclosure: 50 to 200 kJ/K behind 20 to 100 W/K, reached in 10 min to 2 h",
    examples=(Example({"ambient": 26.0, "t_air": 2700.0}, 24.53, {"ambient": 22.0}, 2700.0),),
)
