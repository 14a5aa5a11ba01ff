"""Input guards: what may reach the model, and what stands in for a value that may not.

A bad value is replaced by the last good one and the model goes on integrating. On the virtual machine that
costs far less than freezing the outputs: bodies are slow, inputs return.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag

from discovery.export.document import Input


class Fault(IntFlag):
    """Why an input was replaced (or, the last one, why the gain fades): bits 8 to 13 of the status word."""

    NONE = 0
    NOT_FINITE = 1 << 8
    QUALITY = 1 << 9
    AGE = 1 << 10
    IMPLAUSIBLE = 1 << 11
    JUMP = 1 << 12
    UNTRAINED = 1 << 13


@dataclass(frozen=True, slots=True)
class Reading:
    """What a source says of an input: a value in its unit, the instant [s] at which it was measured, its
    quality.
    """

    value: object
    time: float
    good: bool = True


@dataclass(frozen=True, slots=True)
class Checked:
    """What goes into the model, and why it is not the reading itself."""

    value: float
    fault: Fault
    gain: float


TEMPERATURE_SPAN = 5.0  # K beyond the trained range that half of the fade covers at least
FADE_FROM, FADE_TO = 0.5, 2.0  # spans beyond the trained range at which the gain begins to fall, and is 0


class InputGuard:
    """Checks one input in order: finite, quality, age, plausible, jump (latched), trained range.

    A jump stays latched until the value comes back to what is held, give or take the drift that the
    recordings show, but never more than half of the trained range: a sensor that stays wrong stays out.
    """

    def __init__(self, spec: Input) -> None:
        self.spec = spec
        self.held: float | None = None
        self.held_at = -math.inf  # when it was taken
        self.latched = False
        self.fresh = True  # the next good value is taken without comparing: nothing recent is known

    def check(self, reading: Reading | None, now: float) -> Checked | None:
        """What goes into the model at `now`; None while no good value has ever come."""
        value, fault = self._judge(reading, now)
        if fault is Fault.NONE:
            self.held, self.held_at, self.latched, self.fresh = value, now, False, False
        self.latched |= fault is Fault.JUMP
        if self.held is None:
            return None
        gain = self.gain(self.held)
        return Checked(self.held, fault if gain == 1.0 else fault | Fault.UNTRAINED, gain)

    def _judge(self, reading: Reading | None, now: float) -> tuple[float, Fault]:
        r = self.spec.range
        value = number(reading.value) if reading is not None else math.nan
        if reading is None or not math.isfinite(value):
            return 0.0, Fault.NOT_FINITE
        if not reading.good:
            return 0.0, Fault.QUALITY
        if (
            not abs(now - number(reading.time)) <= r.age_s
        ):  # also a stamp that is no number, or from the future
            return 0.0, Fault.AGE
        if not r.plausible_low <= value <= r.plausible_high:
            return 0.0, Fault.IMPLAUSIBLE
        if self.held is not None and r.step is not None and not self.fresh:
            drift = (r.rate or 0.0) * max(now - self.held_at, 0.0)
            drift = min(drift, 0.5 * (r.high - r.low)) if self.latched else drift
            if abs(value - self.held) > r.step + drift:
                return 0.0, Fault.JUMP
        return value, Fault.NONE

    def gain(self, value: float) -> float:
        """1 inside the trained range and a little beyond, 0 far beyond."""
        r = self.spec.range
        least = TEMPERATURE_SPAN if self.spec.unit == "degC" else max(abs(r.low), abs(r.high), 1e-9)
        beyond = max(r.low - value, value - r.high, 0.0) / max(r.high - r.low, least)
        return min(1.0, max(0.0, (FADE_TO - beyond) / (FADE_TO - FADE_FROM)))


def number(value: object) -> float:
    """A plain number as a float; NaN for anything else.

    >>> number(3), number("3"), number(True), number(10**400)
    (3.0, nan, nan, nan)
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan


def guards(inputs: Sequence[Input]) -> tuple[InputGuard, ...]:
    """One guard for each input."""
    return tuple(InputGuard(spec) for spec in inputs)
