"""The fluid arrives warmer than its sensor shows, and the more so the longer the pump has worked.

    T_fluid + rise d replaces T_fluid in every wet term of the model;  t_sump d' = pump - d,  d(0) = 0

rise in K, 1 to 4: what pump and machine put into the fluid over what it loses, 0.5 to 1 kW over 60 to
100 W/K, as far as a sensor elsewhere in the tank misses it; t_sump in s: C/UA of the fluid, 3 to 6 h.
Source: heat balance of a stirred volume. Limits: the fluid starts as the sensor shows it.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_sump",
    title="Fluid warmer than its sensor",
    group="cutting fluid",
    place="fluid terms",
    formula="fluid + rise*lag(where(time > 0, sign(flow), 0), t_sump)",
    amplitude=Amplitude("rise", "K", 2.0, 0),
    shapes=(Shape("t_sump", "s", 12000.0, factor=1.8),),
    signature="wet bodies follow a fluid that warms over hours of pumping while its sensor does not show it",
    confused_with=("film_drag",),
    source="heat balance of the tank: 0.5 to 1 kW of pump over 60 to 100 W/K, reached in 3 to 6 h",
    examples=(
        Example({"fluid": 26.0, "rise": 2.0, "flow": 1.0, "time": 90000.0, "t_sump": 14000.0}, 28.0),
        # one time constant after the pump began
        Example(
            {"fluid": 26.0, "rise": 2.0, "flow": 1.0, "time": 90000.0, "t_sump": 14000.0},
            27.26,
            {"flow": 0.0},
            14000.0,
        ),
    ),
)
