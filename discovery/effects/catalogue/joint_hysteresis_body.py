"""A body sticks in its seat: its growth reaches the errors with play.

    play(T, width) replaces T in every error    [K]

width in K: 0.5 to 2 um of friction over 3 to 8 um of growth for each kelvin. Source: Prandtl-Ishlinskii play
operator. Limits: one width; the same at any rate, starts in the middle of its play.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="joint_hysteresis",
    title="Hysteresis in the seat of a body",
    group="air and structure",
    place="seat",
    formula="seated*(play(body, width) - body)",
    amplitude=Amplitude("seated", "1", 1.0, 1, 1.0),
    shapes=(Shape("width", "K", 0.4, factor=2.2),),
    signature="errors that a body causes stay constant at every reversal of its temperature, at any rate",
    confused_with=("sensor_lag",),
    source="Prandtl-Ishlinskii play operator of joints, widths of 0.5 to 2 um",
    examples=(Example({"seated": 1.0, "body": 25.0, "width": 0.5}, -0.5, {"body": 22.0}),),
)
