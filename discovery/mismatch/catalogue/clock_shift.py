"""The readings of one recording carry the stamps of another clock.

Written as a delay of every input: what the model is driven by and what the readings say are apart in time.
"""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="clock_shift",
    title="Shifted clock",
    group="measuring chain",
    place="inputs of a recording",
    formula="delay(input, t_shift)",
    amplitude=Amplitude("on", "1", 1.0, 1, 1.0),
    shapes=(
        Shape(
            "t_shift", "s", (-3600.0, -1800.0, -900.0, -300.0, 300.0, 900.0, 1800.0, 3600.0), -7200.0, 7200.0
        ),
    ),
    signature="every error of a recording is late (or early) by the same time",
    confused_with=("fluid_delay", "sensor_lag"),
    source="two loggers with clocks of their own",
    one_recording=True,
)
