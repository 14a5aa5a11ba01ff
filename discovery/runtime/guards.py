"""Input guards: what may reach the model, and what stands in for a value that may not.

A bad value is replaced by the last good one (of an input that switches, after some minutes, by its mean) and
the model goes on integrating. On the virtual machine that
costs far less than freezing the outputs: bodies are slow, inputs return.

A value that steps away is held back until it has stayed: minutes where physics allows such a step (a door, a
chiller) or another sensor steps the same way, hours where it does not. A step is never held back for good.
The C and structured text targets carry the same checks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag

from discovery.export.document import Input
from discovery.export.guarding import (
    CONFIRM_S,
    FADE_FROM,
    FADE_TO,
    FAR_S,
    FURTHER,
    LEAK,
    MEAN_S,
    TOGETHER,
    span,
)


class Fault(IntFlag):
    """Why an input was replaced (or, the last one, why the gain fades): bits 8 to 13 of the status word."""

    NONE = 0
    NOT_FINITE = 1 << 8
    QUALITY = 1 << 9
    AGE = 1 << 10  # too old, or it stands still for longer than the sensor ever did
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


class InputGuard:
    """Checks one input in order: finite, quality, age, plausible, still, jump, trained range.

    A jump of a temperature is a difference from the held value beyond what noise and drift explain; a jump of
    a held input (speed, power, flow) is a value far outside its training, for inside it may switch at will.
    """

    def __init__(self, spec: Input) -> None:
        self.spec = spec
        self.held: float | None = None
        self.held_at = -math.inf  # when it was taken
        self.mean = 0.0  # of what was taken, over about MEAN_S
        self.fresh = True  # the next good value is taken without comparing: nothing recent is known
        self.seen: float | None = None  # the last value that came, good or not
        self.seen_at = -math.inf
        self.still_since = -math.inf
        self.waiting: float | None = None  # the value that waits until it has stayed
        self.waiting_from = 0.0  # instant of the step it waits for
        self.stayed = 0.0  # s
        self.accepted = False  # a step has stayed long enough with this very value

    @property
    def direction(self) -> int:
        """Sign of the step of a temperature that waits; 0: none does."""
        if self.waiting is None or self.held is None or self.spec.range.step is None:
            return 0
        return 1 if self.waiting > self.held else -1

    def check(self, reading: Reading | None, now: float, together: bool = False) -> Checked | None:
        """What goes into the model at `now`; None while no good value has ever come.

        `together`: another input waits with a step in the same direction.
        """
        self.accepted = False
        value, fault = self._judge(reading, now, together)
        if fault is Fault.NONE:
            passed = min(max(now - self.held_at, 0.0), self.spec.range.age_s)
            self.mean = (
                value if self.held is None else self.mean + (value - self.mean) * passed / (MEAN_S + passed)
            )
            self.held, self.held_at, self.fresh = value, now, False
        if self.held is None:
            return None
        gain = self.gain(self.held)
        return Checked(self._stand_in(now), fault if gain == 1.0 else fault | Fault.UNTRAINED, gain)

    def _stand_in(self, now: float) -> float:
        """What goes into the model: the last good value. A machine that cuts and pauses is better described
        by its mean than by the moment in which a speed or a power was lost.
        """
        assert self.held is not None
        lost = self.spec.range.step is None and now - self.held_at > self.spec.range.age_s
        return self.mean if lost else self.held

    def accept(self) -> None:
        """An operator says that the next good value is right."""
        self.fresh, self.waiting, self.stayed = True, None, 0.0

    def _judge(self, reading: Reading | None, now: float, together: bool) -> tuple[float, Fault]:
        r = self.spec.range
        value = number(reading.value) if reading is not None else math.nan
        if reading is None or not math.isfinite(value):
            return 0.0, Fault.NOT_FINITE
        if not reading.good:
            return 0.0, Fault.QUALITY
        if not abs(now - number(reading.time)) <= r.age_s:  # also a stamp that is no number, or in the future
            return 0.0, Fault.AGE
        if not r.plausible_low <= value <= r.plausible_high:
            return 0.0, Fault.IMPLAUSIBLE
        if value != self.seen or self.fresh:
            self.still_since = now
        elapsed = min(max(now - self.seen_at, 0.0), r.age_s)
        before, self.seen, self.seen_at = self.seen, value, now
        if r.still_s is not None and now - self.still_since > r.still_s:
            return 0.0, Fault.AGE
        waits = self._waits(value, before, elapsed, now, together)
        return value, Fault.JUMP if waits else Fault.NONE

    def _waits(self, value: float, before: float | None, elapsed: float, now: float, together: bool) -> bool:
        """Whether a value steps away and has not yet stayed for long enough."""
        r = self.spec.range
        if r.step is None:  # held: it may switch inside its training at will
            was = 0.0 if self.held is None else self.outside(self.held)
            away = self.outside(value) > max(FADE_FROM, FURTHER * was)
            steady, allowed = True, True
        else:
            since = now if self.waiting is None else self.waiting_from
            away = (
                self.held is not None
                and not self.fresh
                and abs(value - self.held) > self._usual(since - self.held_at)
            )
            steady = before is not None and abs(value - before) <= self._usual(elapsed)
            allowed = self.held is None or r.sudden is None or abs(value - self.held) <= r.sudden
        if not away:
            self.waiting = None
            self.stayed = 0.0 if r.step is not None else max(0.0, self.stayed - LEAK * elapsed)
            return False
        if self.waiting is None:
            self.waiting_from = now
            steady = steady and r.step is None  # a temperature begins to stay with the value after its step
        self.stayed = self.stayed + elapsed if steady else 0.0
        self.waiting = value
        needed = (CONFIRM_S if allowed else FAR_S) * (TOGETHER if together and allowed else 1.0)
        if self.stayed < needed:
            return True
        self.accepted = self.stayed - elapsed < needed
        self.waiting, self.stayed = None, 0.0 if r.step is not None else min(self.stayed, 2.0 * CONFIRM_S)
        return False

    def _usual(self, elapsed: float) -> float:
        """Largest difference [unit] of two values so far apart that noise and drift explain."""
        r = self.spec.range
        return (r.step or 0.0) + (r.rate or 0.0) * max(elapsed, 0.0)

    def outside(self, value: float) -> float:
        """How far a value is outside the trained range, in spans of it."""
        r = self.spec.range
        return max(r.low - value, value - r.high, 0.0) / span(self.spec)

    def gain(self, value: float) -> float:
        """1 inside the trained range and a little beyond, 0 far beyond."""
        return min(1.0, max(0.0, (FADE_TO - self.outside(value)) / (FADE_TO - FADE_FROM)))


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
