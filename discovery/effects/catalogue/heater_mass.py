"""What makes the heat has a mass of its own and warms first: an element, a winding, a ring of a bearing.

    t_h P_h' = P - P_h;  P_h replaces P in the terms that heat the body

t_h = C_h/G_h in s: seconds of a bare wire, 10 to 60 s of an oven's element, 1 to 10 min of a winding. Source:
heat balance of the heater, C_h dT_h/dt = P - G_h (T_h - T), in which P_h is what it passes on. Limits: what
the body itself does to the heater is left out; settled at the first instant.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="heater_mass",
    title="A heater with a mass of its own",
    group="drive and cooling",
    place="heat of a body",
    formula="stored*(lag(term, t_h) - term)",
    amplitude=Amplitude("stored", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_h", "s", None),),
    signature="heat reaches the body late and smoothed after each change of the power",
    confused_with=("sensor_lag", "second_thermal_mass"),
    source=(
        "two-node model of a heater and what it heats, as of winding and frame (Boglietti et al., IEEE "
        "Trans. Ind. Electron. 56, 2009, 871)"
    ),
    examples=(Example({"stored": 1.0, "term": 100.0, "t_h": 60.0}, -36.79, {"term": 0.0}, 60.0),),
)
