"""The readings of one recording carry the stamps of another clock.

    every input u(t) of that recording becomes u(t - t_shift)

t_shift in s, minutes to an hour, positive where the errors come late. Written as a delay of the inputs:
what drives the model and what the readings say are apart in time. Source: two loggers with clocks of
their own. Limits: one shift for a whole recording; a clock that runs fast is not covered.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="clock_shift",
    title="Shifted clock",
    group="measuring chain",
    place="inputs of a recording",
    formula="delay(input, t_shift)",
    amplitude=Amplitude("shifted", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_shift", "s", 0.0, spread=1800.0),),
    signature="every error of a recording is late (or early) by the same time",
    confused_with=("fluid_delay", "sensor_lag"),
    source="two loggers with clocks of their own",
    acts="in one recording",
    examples=(Example({"input": 400.0, "t_shift": 900.0}, 100.0, {"input": 100.0}, 600.0),),
)
