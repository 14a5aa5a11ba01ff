"""Guards, limits and fades in C: their numbers as settings, and the code that ticks with them."""

from __future__ import annotations

import math
from dataclasses import fields

from discovery.export.document import Exported
from discovery.export.guarding import (
    CONSTANTS,
    MEANING,
    GuardNumbers,
    compensated,
    guard_numbers,
    times,
)
from discovery.export.templated import templated


def real(value: float) -> str:
    """A number as the macro R() takes it.

    >>> real(0.1), real(-3.0)
    ('R(0.1)', 'R(-3.0)')
    """
    if math.isnan(value):
        return "(R(0.0)/R(0.0))"
    if math.isinf(value):
        return "R_HUGE" if value > 0 else "(-R_HUGE)"
    return f"R({float(value)!r})"


def _setting_arrays(exported: Exported) -> dict[str, list[float]]:
    """Numbers of the guards by input, limits of the offsets, by name."""
    guards = [guard_numbers(spec) for spec in exported.inputs]
    found = {f.name: [float(getattr(g, f.name)) for g in guards] for f in fields(GuardNumbers)}
    ranges = [exported.outputs[k].range for k in compensated(exported)]
    return found | {"limit": [r.limit for r in ranges], "rate_of_offset": [r.rate for r in ranges]}


def settings(exported: Exported, prefix: str) -> tuple[str, str]:
    """Declaration and default values of the settings."""
    up, declared, values = prefix.upper(), [], []
    for name, numbers in _setting_arrays(exported).items():
        size = "OFFSETS" if name in ("limit", "rate_of_offset") else "INPUTS"
        declared.append(f"    {prefix}_real {name}[{up}_{size} + 1]; /* {MEANING[name]} */")
        values.append(f"    {{{', '.join([*map(real, numbers), 'R(0.0)'])}}},")
    for name, value in times().items():
        declared.append(f"    {prefix}_real {name}; /* {MEANING[name]} */")
        values.append(f"    {real(value)},")
    return "\n".join(declared), "\n".join(values).rstrip(",")


def guard_source(exported: Exported, prefix: str) -> str:
    """The guarded tick: `<prefix>_begin` and `<prefix>_tick`."""
    return templated(
        "guard.c",
        prefix,
        SETTINGS=settings(exported, prefix)[1],
        PLACES="".join(f"{k}, " for k in compensated(exported)),
        **{name: real(value) for name, value in CONSTANTS.items()},
    )
