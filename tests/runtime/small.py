"""The smallest model that compensates, for tests of the runtime."""

from __future__ import annotations

from discovery.export.compiled import compile_model
from discovery.export.document import Exported, Input, Output
from discovery.export.ranges import InputRange, OutputRange
from discovery.export.seal import Seal
from discovery.models import Model, State
from discovery.terms import Term, parse

TEMPERATURE = Input(
    "T", "ambient temperature", "degC", "linear", InputRange(20, 24, -30, 60, 0.5, 0.001, 300.0, 8.0, 3600.0)
)


POWER = Input("P", "heat load", "W", "held", InputRange(0, 800, 0, 2000, None, None, 300.0))


def small(rate: str = "P/1000 - y/600", inputs: tuple[Input, ...] = (POWER,)) -> Exported:
    """One error that follows a power, at most 100 um and 1 um/s."""
    model = Model(
        "small",
        {},
        {"y": State("y", "um", None, parse(0.0), 0.0, 1.0)},
        (Term("t", "y", parse(rate)),),
        {"E": parse("y")},
    )
    outputs = (Output("E", "error", "um", OutputRange(100.0, 1.0)),)
    return Exported(
        model, compile_model(model, 1.0), inputs, outputs, 1, {}, (), {}, Seal("0" * 64, None, None)
    )
