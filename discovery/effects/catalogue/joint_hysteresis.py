"""A joint sticks before it slides: part of the error follows with play.

    error shown = y + slip (play(y, width) - y)    [um]

slip: share of the error that passes the joint, 0 to 1; width in um (or um/m), 0.5 to 2 for joints of
machine tools, up to some 25 where long or light parts slide (extruder, printer). Source: Prandtl-Ishlinskii
play operator. Limits: one width; the same at any rate, starts in the middle of its play.
"""

from discovery.effects.form import ALL, Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="joint_hysteresis",
    title="Hysteresis of a joint",
    group="air and structure",
    place="output that is no temperature",
    formula="slip*(play(y, width) - y)",
    amplitude=Amplitude("slip", "1", 0.5, most=ALL),
    shapes=(Shape("width", "um", 2.0, factor=3.5),),
    signature="a plateau at every reversal, the same at any rate",
    confused_with=("sensor_lag",),
    source="Prandtl-Ishlinskii play operator of joints, widths of 0.5 to 2 um",
    examples=(Example({"slip": 0.5, "y": 10.0, "width": 1.0}, -0.5, {"y": 4.0}),),
)
