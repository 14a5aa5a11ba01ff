"""The readings of every recording come late by the same time.

    every input u(t) becomes u(t - t_shift)

t_shift in s, minutes to an hour. As `clock_shift`, in all recordings: either clock may be wrong, or heat
takes as long to arrive. Recordings of one logger cannot say which. Source: two loggers with clocks of their
own. Limits: as `clock_shift`.
"""

from dataclasses import replace

from discovery.effects.catalogue import clock_shift
from discovery.effects.form import Shape

EFFECT = replace(
    clock_shift.EFFECT,
    title="Shifted clock or dead time in every recording",
    acts="always",
    shapes=(Shape("t_shift", "s", 900.0, factor=2.2, is_shift=True),),
    signature="every error of every recording is late by the same time",
)
