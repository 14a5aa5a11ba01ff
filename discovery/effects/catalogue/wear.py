"""Losses that changed between two recordings: another share of the drive power heats the body.

    q = wear P in one recording    [W]

wear: change of the loss share, of either sign, up to 0.3. Source: friction torque -70 % after 4 to 7
years (TU Dresden 2023), a run-in step of 30 %. Limits: a step between recordings, never inside one; what
all recordings share is the model's own parameter.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example

EFFECT = Effect(
    word="wear",
    title="Friction that ages",
    group="drive and cooling",
    place="driven body",
    formula="wear*load",
    amplitude=Amplitude("wear", "1", 0.15, 0),
    signature="the gain of the drive losses differs between recordings",
    confused_with=("friction_speed",),
    source=(
        "friction torque -70 % after 4 to 7 years (TU Dresden 2023); a run-in step of 30 % between recordings"
    ),
    one_recording=True,
    examples=(Example({"wear": -0.1, "load": 400.0}, -40.0),),
)
