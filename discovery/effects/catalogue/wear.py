"""Losses that changed between recordings, and stay so: friction ages or runs in.

    q = wear q_loss    [W] at each body, from a recording on; or k wear q_loss in the k-th one after the first

q_loss is what the losses of the model are there, of a recorded power or by a law of the speed (or strokes);
wear: change of them, of either sign, -0.7 to 0.5. Source: friction torque -70 % after 4 to 7 years
(Zwingenberger, TU Dresden, 2023), a run-in step of 30 %. Limits: a step between recordings, or as much from
each recording to the next, in the order of their dates, never inside one; what all recordings share is the
model's own parameter.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="wear",
    title="Friction that ages",
    group="drive and cooling",
    place="loss terms",
    formula="wear*term",
    amplitude=Amplitude("wear", "1", 0.3, 0),
    signature="the gain of the drive losses is another one from a recording on, or in each recording",
    confused_with=("friction_speed",),
    source=(
        "friction torque -70 % after 4 to 7 years (TU Dresden 2023); a run-in step of 30 % between recordings"
    ),
    acts="as parts age",
    examples=(Example({"wear": -0.25, "term": 160.0}, -40.0),),
)
