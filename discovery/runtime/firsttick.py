"""Units that are wrong at the start: a first value far outside of the training that another unit explains."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from discovery.errors import UserError
from discovery.export.document import Input
from discovery.runtime.guards import InputGuard, Reading, number

# What a number may have been meant as: unit of the model, other unit, conversion
_OTHER: tuple[tuple[str, str, Callable[[float], float]], ...] = (
    ("degC", "kelvin", lambda v: v - 273.15),
    ("degC", "degrees Fahrenheit", lambda v: (v - 32.0) / 1.8),
    ("degC", "hundredths of a degree", lambda v: v / 100.0),
    ("degC", "tenths of a degree", lambda v: v / 10.0),
    ("W", "milliwatts", lambda v: v / 1000.0),
    ("1", "percent", lambda v: v / 100.0),
    ("mm", "micrometres", lambda v: v / 1000.0),
    ("rpm", "degrees per second", lambda v: v / 6.0),
)


def refuse_wrong_units(inputs: Sequence[Input], readings: Mapping[str, Reading], known: set[str]) -> None:
    """Refuse readings whose unit is not that of the model.

    Args:
        known: inputs of which a value has come before; those of which one comes now are added.

    Raises:
        UserError: a value so far outside of the training that the gain is zero, and inside of it in another
        unit.
    """
    for spec in inputs:
        reading = readings.get(spec.name)
        guard, value = InputGuard(spec), number(reading.value if reading is not None else None)
        if value != value or spec.name in known:
            continue
        known.add(spec.name)
        if guard.gain(value) > 0.0:
            continue
        for unit, other, convert in _OTHER:
            if spec.unit == unit and guard.outside(convert(value)) <= 0.2:
                raise UserError(
                    f"{spec.name} is {value:g} at first, which looks like {other} "
                    f"({convert(value):.4g} {unit} would fit the training, {spec.range.low:g} to "
                    f"{spec.range.high:g} {unit}); give it in {unit}"
                )
