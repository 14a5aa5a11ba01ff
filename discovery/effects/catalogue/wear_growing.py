"""Losses that change from each recording to the next by as much: friction ages, or runs in.

    q = k wear_each q_loss    [W] at each body, in the k-th recording after the first one

wear_each: change from one recording to the next, of either sign, -0.3 to 0.3. As `wear`, with a step between
any two recordings. Source: friction torque -70 % after 4 to 7 years (TU Dresden 2023). Limits: recordings are
taken to be as far apart as each other, in the order of their dates; of two recordings, it is a step.
"""

from dataclasses import replace

from discovery.effects.catalogue import wear
from discovery.effects.form import Amplitude, Example

EFFECT = replace(
    wear.EFFECT,
    title="Friction that ages from recording to recording",
    formula="wear_each*term",
    amplitude=Amplitude("wear_each", "1", 0.1, 0),
    signature="the gain of the drive losses changes by as much from each recording to the next",
    source="friction torque -70 % after 4 to 7 years (TU Dresden 2023)",
    grows=True,
    examples=(Example({"wear_each": -0.1, "term": 160.0}, -16.0),),
)
