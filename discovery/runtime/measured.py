"""Measured errors among the readings of a tick, each counted once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from discovery.runtime.guards import Reading, number


def new_errors(
    names: Iterable[str],
    readings: Mapping[str, Reading],
    counted: dict[str, float],
    since: float = -math.inf,
    until: float = math.inf,
) -> dict[str, float]:
    """Good measured errors that are newer than those before, as they would be without compensation.

    Where the machine was compensated, `NAME_applied` says by how much, and is added. A source may show one
    reading for many ticks.

    Args:
        counted: instant [s] of the last reading of each error; those found here are entered.
        since, until: instants [s] between which a reading counts.
    """
    found = {}
    for name in names:
        reading, applied = readings.get(name), readings.get(f"{name}_applied")
        if reading is None or not reading.good or (applied is not None and not applied.good):
            continue
        stamp = number(reading.time)
        value = number(reading.value) + (number(applied.value) if applied is not None else 0.0)
        if math.isfinite(value) and counted.get(name, since) < stamp <= until:
            counted[name] = stamp
            found[name] = value
    return found
