"""A recorded input did not act for a time: a nozzle was clogged, a contactor open, a pump ran dry.

    (1 - missed) f(u) + missed f(0) replaces f(u) while t_on <= time < t_off, in every term f of the model

missed: share of what the input does that it did not do, 0 to 1. Source: operator logs; what a control records
is what it asked for. Limits: constant within its window; inputs that are temperatures are none of these; what
comes again and again has a cause to look for, and the verdict is `unexplained`.
"""

from discovery.effects.form import ALL, Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="input_missed",
    title="Input that did not act for a time",
    group="measuring chain",
    place="driving input",
    formula="input*(1 - where(time >= t_on, 1, 0)*where(time < t_off, 1, 0))",
    amplitude=Amplitude("missed", "1", 0.8, 1, most=ALL),
    shapes=(Shape("t_on", "s", 0.0, instant=True), Shape("t_off", "s", 1e9, instant=True)),
    signature="for some hours of one recording every body goes on as if an input were off",
    confused_with=("unmeasured_heat", "draught", "sensor_offset"),
    source="a control records what it asks for: clogged nozzles, open contactors, pumps that run dry",
    search="window",
    acts="in one recording",
    examples=(
        Example({"input": 200.0, "time": 5000.0, "t_on": 3600.0, "t_off": 7200.0}, 0.0),
        Example({"input": 200.0, "time": 8000.0, "t_on": 3600.0, "t_off": 7200.0}, 200.0),
    ),
)
