"""The compensator: one tick after the other, readings in, offsets out.

Whatever comes in, an offset is finite, within its limit, and moves from tick to tick no faster than its rate
allows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.stepper import Stepper
from discovery.runtime.fastforward import fast_forward
from discovery.runtime.guards import Fault, Reading, guards

Array = NDArray[np.float64]


class State(Enum):
    """States of the runtime; the value is the low byte of the status word."""

    OFF = 0  # offsets are zero, or on their way there
    COLD = 1  # started without a saved state: the start values still count
    WARM = 2  # started from a saved state through a gap
    ACTIVE = 3
    DEGRADED = 4  # an input is replaced by its last good value, for a limited time
    FROZEN = 5  # the model failed: offsets are held until the part is done
    FAULT = 6  # offsets ramp to zero; goes on after `acknowledge`


@dataclass(frozen=True)
class Settings:
    """Times of the runtime in s."""

    tick_s: float | None = (
        None  # usual time between ticks, for which an offset may move; default the step of the model
    )
    catch_up_s: float = 600.0  # late ticks are made up for as far as this; a longer gap is fast-forwarded
    longest_gap_s: float = 30 * 24 * 3600.0  # beyond this the model starts anew
    hold_limit_s: float = 4 * 3600.0  # longest replacement of an input
    freeze_limit_s: float = 2 * 3600.0  # longest hold of the outputs
    settle_s: float = 8 * 3600.0  # COLD and WARM last as long
    bump_s: float = 1800.0  # time constant with which the difference at a change of model fades


BUMP, LATE, LIMITED, RATED, UNTIMELY = 1 << 16, 1 << 17, 1 << 18, 1 << 19, 1 << 20


@dataclass(frozen=True)
class Tick:
    """What a tick gives out. `offsets`: what to add to the position, minus the predicted error, in um or um/m
    by name of the error, valid at `valid_at` [s]. `status`: state in bits 0 to 7, input faults in 8 to 13,
    then bump, late, limited, rate-limited, clock not moving forward. `heartbeat` counts ticks."""

    valid_at: float
    offsets: Mapping[str, float]
    state: State
    status: int
    heartbeat: int
    faults: Mapping[str, Fault]


class Compensator:
    """A model at work."""

    def __init__(self, exported: Exported, settings: Settings | None = None) -> None:
        self.exported, self.settings = exported, settings or Settings()
        self.stepper = Stepper(exported.compiled)
        self.guards = guards(exported.inputs)
        self.places = [k for k, output in enumerate(exported.outputs) if output.role == "error"]
        self.names = [exported.outputs[k].name for k in self.places]
        self.limit = [exported.outputs[k].range.limit for k in self.places]
        self.rate = [exported.outputs[k].range.rate for k in self.places]
        self.state = State.OFF
        self.offsets = [0.0] * len(self.places)
        self.bump = [0.0] * len(self.places)
        self.predicted: Array | None = None  # outputs of the model (Y,) at the end of its last step
        self.inputs: Array | None = None  # inputs (U,) of that step
        self.origin: float | None = None  # instant of the model's first step
        self.last: float | None = None  # instant of the last tick
        self.since = 0.0  # when the present spell of trouble, or of settling, began
        self.settling = State.COLD
        self.started_at = 0.0
        self.heartbeat = 0
        self.inherited: Mapping[str, float] | None = (
            None  # states of the model before this one, taken over at the start
        )

    def tick(
        self, readings: Mapping[str, Reading], now: float, *, enabled: bool = True, part_done: bool = False
    ) -> Tick:
        """One tick at `now` [s on the clock of the readings]; see `Tick`. Never raises for what comes in."""
        self.heartbeat += 1
        flags = 0
        if not math.isfinite(now) or (self.last is not None and now < self.last):
            flags |= UNTIMELY
            now = self.last if self.last is not None else 0.0
        elapsed = 0.0 if self.last is None else now - self.last
        self.last = now
        if elapsed > self.settings.catch_up_s:
            for guard in self.guards:
                guard.fresh = True
        checked = [guard.check(readings.get(guard.spec.name), now) for guard in self.guards]
        faults = {
            g.spec.name: c.fault if c else Fault.NOT_FINITE for g, c in zip(self.guards, checked, strict=True)
        }
        good = [c for c in checked if c is not None]
        gain = min((c.gain for c in good), default=1.0)
        failed = False
        if len(good) == len(checked):
            late, failed = self._advance(np.array([c.value for c in good]), now)
            flags |= LATE * late
        self._change_state(faults, failed, now, enabled=enabled, part_done=part_done)
        flags |= self._move(gain, elapsed)
        for fault in faults.values():
            flags |= int(fault)
        valid = now + self.exported.compiled.step_s
        offsets = dict(zip(self.names, self.offsets, strict=True))
        return Tick(valid, offsets, self.state, flags | self.state.value, self.heartbeat, faults)

    def _advance(self, u: Array, now: float) -> tuple[bool, bool]:
        """Bring the model to `now`: whether it was late, whether it failed."""
        step = self.exported.compiled.step_s
        if self.origin is None or now - self.origin - self.stepper.count * step > self.settings.longest_gap_s:
            try:
                self.stepper.start(u)
            except UserError:  # these inputs give no start: stay off, try again with the next ones
                return False, True
            self.origin, self.started_at, self.settling = now, now, State.COLD
            if self.inherited is not None:
                self._take_over(self.inherited)
        due = math.floor((now - self.origin) / step + 1e-9) + 1 - self.stepper.count
        late = due * step > self.settings.catch_up_s
        if late:
            before = self.stepper.count
            fast_forward(self.exported, self.stepper, u if self.inputs is None else self.inputs, u, due - 1)
            self.settling, self.started_at = State.WARM, now
            due -= self.stepper.count - before
        if due <= 0:
            return False, False
        held = np.tile(
            u if self.inputs is None else self.inputs, (due, 1)
        )  # missed steps: as the inputs were
        held[-1] = u
        y = self.stepper.run(held)
        if len(y):
            if self.inherited is not None:
                self._no_bump(y[-1])
            self.predicted = y[-1]
        if len(y) == due:  # inputs that the model fails on are never held
            self.inputs = u
        return late or due > 1, len(y) < due

    def _change_state(
        self, faults: Mapping[str, Fault], failed: bool, now: float, *, enabled: bool, part_done: bool
    ) -> None:
        s, replaced = self.settings, any(fault & ~Fault.UNTRAINED for fault in faults.values())
        if not enabled:
            self.state = State.OFF
        elif self.state is State.FAULT or self.origin is None:
            pass
        elif failed:
            if self.state is not State.FROZEN:
                self.state, self.since = State.FROZEN, now
            if part_done or now - self.since > s.freeze_limit_s:
                self.state = State.FAULT
        elif replaced:
            if self.state is not State.DEGRADED:
                self.state, self.since = State.DEGRADED, now
            if now - self.since > s.hold_limit_s:
                self.state = State.FAULT
        else:
            self.state = self.settling if now - self.started_at < s.settle_s else State.ACTIVE

    def _move(self, gain: float, elapsed: float) -> int:
        """Move the offsets towards their targets, as far as limit and rate allow."""
        flags = 0
        fade = math.exp(-elapsed / self.settings.bump_s)
        usual = self.settings.tick_s or self.exported.compiled.step_s
        allowed = min(elapsed, usual) if self.heartbeat > 1 else 0.0
        for k, place in enumerate(self.places):
            self.bump[k] *= fade
            target = self.offsets[k]
            if self.state in (State.OFF, State.FAULT):
                target = 0.0
            elif self.state is not State.FROZEN and self.predicted is not None:
                target = self.bump[k] - gain * float(self.predicted[place])
            if abs(self.bump[k]) > 1e-3:
                flags |= BUMP
            if not math.isfinite(target):
                target = self.offsets[k]
            if abs(target) > self.limit[k]:
                target, flags = math.copysign(self.limit[k], target), flags | LIMITED
            most = self.rate[k] * allowed
            if abs(target - self.offsets[k]) > most:
                target, flags = self.offsets[k] + math.copysign(most, target - self.offsets[k]), flags | RATED
            self.offsets[k] = target
        return flags

    def states(self) -> dict[str, float]:
        """States of the model by name."""
        return dict(zip(self.exported.compiled.states, self.stepper.x.tolist(), strict=True))

    def succeed(self, states: Mapping[str, float], offsets: Mapping[str, float]) -> None:
        """Begin where another model stopped: its states by name, its offsets; the difference fades
        (`bump_s`).
        """
        self.inherited = dict(states)
        self.offsets = [float(offsets.get(name, 0.0)) for name in self.names]

    def _take_over(self, states: Mapping[str, float]) -> None:
        for i, name in enumerate(self.exported.compiled.states):
            value = states.get(name, math.nan)
            if math.isfinite(value):
                self.stepper.x[i] = value
        self.settling = State.WARM

    def _no_bump(self, predicted: Array) -> None:
        self.bump = [
            offset + float(predicted[place]) for offset, place in zip(self.offsets, self.places, strict=True)
        ]
        self.inherited = None

    def acknowledge(self) -> None:
        """Go on after a FAULT: the model starts anew with the next good inputs, the offsets from where they
        are.
        """
        self.state, self.origin, self.predicted = State.OFF, None, None
        self.settling = State.COLD
        self.bump = [0.0] * len(self.places)
