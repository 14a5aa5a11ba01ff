"""A body sticks in its seat: its growth reaches the errors with play.

    play(T, width) stands for T in every error    [K]

width in K: 0.5 to 2 um of friction over 3 to 8 um of growth for each kelvin. Source: Prandtl-Ishlinskii play
operator. Limits: one width; the same at any rate, starts in the middle of its play.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="joint_hysteresis",
    title="Hysteresis in the seat of a body",
    group="air and structure",
    place="seat",
    formula="on*(play(body, width) - body)",
    amplitude=Amplitude("on", "1", 1.0, 1, 1.0),
    shapes=(Shape("width", "K", (0.15, 0.4, 1.0), 0.02, 5.0),),
    signature="errors that a body causes stand still at every reversal of its temperature, at any rate",
    confused_with=("sensor_lag",),
    source="Prandtl-Ishlinskii play operator of joints, widths of 0.5 to 2 um",
    prior=0.5,
    examples=(Example({"on": 1.0, "body": 25.0, "width": 0.5}, -0.5, {"body": 22.0}),),
)
