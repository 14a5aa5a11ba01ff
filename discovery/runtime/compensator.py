"""The compensator: one tick after the other, readings in, offsets out.

Whatever comes in, an offset is finite, within its limit, and moves from tick to tick no faster than its rate
allows. Every state but OFF ends by itself once the inputs have been good for `recover_s`.
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
from discovery.export.guarding import Times, compensated
from discovery.export.stepper import Stepper
from discovery.runtime.events import Change, Event, state_event
from discovery.runtime.fastforward import fast_forward
from discovery.runtime.guards import Checked, Fault, Reading, guards, number
from discovery.runtime.hindsight import LONGEST_S, Hindsight
from discovery.runtime.measured import new_errors
from discovery.runtime.observer import SETTLED, Observer, levels

Array = NDArray[np.float64]


class State(Enum):
    """States of the runtime; the value is the low byte of the status word."""

    OFF = 0  # offsets are zero, or on their way there
    COLD = 1  # started without a saved state: the start values still count
    WARM = 2  # started from a saved state through a gap, or after a fault
    ACTIVE = 3
    DEGRADED = 4  # an input is replaced by its last good value, for a limited time
    FROZEN = 5  # the model failed: offsets are held until the part is done
    FAULT = 6  # offsets ramp to zero until the inputs are good again


@dataclass(frozen=True)
class Settings(Times):
    """Times of the runtime in s."""

    tick_s: float | None = (
        None  # usual time between ticks, for which an offset may move; default the step of the model
    )
    catch_up_s: float = 600.0  # late ticks are made up for as far as this; a longer gap is fast-forwarded
    longest_gap_s: float = 30 * 24 * 3600.0  # beyond this the model starts anew
    bump_s: float = 1800.0  # time constant with which the difference at a change of model fades
    hindsight: bool = True  # go through a gap of an input again once it is back; controllers cannot
    observe: bool = True  # measured errors correct the states after a gap of the model; controllers cannot


BUMP, LATE, LIMITED, RATED, UNTIMELY = 1 << 16, 1 << 17, 1 << 18, 1 << 19, 1 << 20
AHEAD_S = 60.0  # of the clock of a reading; one that claims more would keep all later ones out
AGES_EVERY_S = 3600.0  # parameters that move by date are moved so often
TROUBLE = (State.DEGRADED, State.FROZEN, State.FAULT)


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
    events: tuple[Event, ...] = ()


class Compensator:
    """A model at work."""

    def __init__(self, exported: Exported, settings: Settings | None = None) -> None:
        self.exported, self.settings = exported, settings or Settings()
        self.stepper = Stepper(exported.compiled)
        self.guards = guards(exported.inputs)
        self.places = compensated(exported)
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
        self.since = 0.0  # when the model failed
        self.good_since: float | None = None  # since when all inputs are good; None: they are not
        self.settling = State.COLD
        self.started_at = 0.0
        self.heartbeat = 0
        self.gain = 1.0
        self.hindsight: Hindsight | None = None  # since an input is replaced
        self.level = levels(exported.document, exported.compiled)
        self.observer: Observer | None = None  # since a gap, until measured errors have settled the states
        self.uncertain = 0.0  # how far predictions are, in residuals of the fit, since nobody fed the model
        self.acknowledged = False  # an operator has looked since the last tick
        self.shift = 0.0  # added to the clock of the readings where it was set back [s]
        self.events: list[Event] = []  # of the present tick
        self.aged_at = -math.inf  # when the parameters that move by date were moved last
        self.inherited: Mapping[str, float] | None = (
            None  # states of the model before this one, taken over at the start
        )

    def tick(
        self,
        readings: Mapping[str, Reading],
        now: float,
        *,
        enabled: bool = True,
        part_done: bool = False,
        acknowledge: bool = False,
    ) -> Tick:
        """One tick at `now` [s on the clock of the readings]; see `Tick`. Never raises for what comes in.

        `part_done`: a FROZEN compensation may let go of its offsets. `acknowledge`: an operator has looked;
        steps that wait are accepted, and a FAULT ends with the next good inputs.
        """
        self.heartbeat += 1
        self.events = []
        now, flags = self._on_time(now)
        elapsed = 0.0 if self.last is None else now - self.last
        self.last = now
        if elapsed > self.settings.catch_up_s:
            for guard in self.guards:
                guard.fresh = True
        if acknowledge:
            self.acknowledge()
        hurry, self.acknowledged = self.acknowledged, False
        checked = self._checked(readings, now)
        faults = {
            g.spec.name: c.fault if c else Fault.NOT_FINITE for g, c in zip(self.guards, checked, strict=True)
        }
        good = [c for c in checked if c is not None]
        failed = False
        if len(good) == len(checked):
            lost = np.array([bool(c.fault & ~Fault.UNTRAINED) for c in good])
            late, failed = self._advance(np.array([c.value for c in good]), lost, now)
            flags |= LATE * late
        self._tell_accepted(now)
        self._tell_gain(min((c.gain for c in good), default=1.0), now)
        was = self.state
        self._change_state(faults, failed, now, enabled=enabled, part_done=part_done, hurry=hurry)
        if self.state is not was:
            on = was is State.OFF and self.started_at < now
            change = Change(was.name, self.state.name, failed=failed, switched_on=on)
            self.events.append(state_event(change, self.guards, faults, readings, now))
        flags |= self._move(elapsed)
        self._observe(readings, now)
        for fault in faults.values():
            flags |= int(fault)
        valid = now + self.exported.compiled.step_s
        offsets = dict(zip(self.names, self.offsets, strict=True))
        status = flags | self.state.value
        return Tick(valid, offsets, self.state, status, self.heartbeat, faults, tuple(self.events))

    def _on_time(self, now: float) -> tuple[float, int]:
        """The instant of this tick on a clock that never goes back, and the flag that it did."""
        if not math.isfinite(now):
            return (self.last if self.last is not None else 0.0), UNTIMELY
        now += self.shift
        if self.last is None or now >= self.last:
            return now, 0
        if self.last - now > self.settings.catch_up_s:  # not a tick out of order: the clock was set
            back = self.last - now
            self.shift += back
            self.events.append(Event(self.last, "clock", f"the clock of the ticks went back by {back:.0f} s"))
        return self.last, UNTIMELY

    def _checked(self, readings: Mapping[str, Reading], now: float) -> list[Checked | None]:
        ways = [guard.direction for guard in self.guards]
        found = []
        for k, guard in enumerate(self.guards):
            reading = readings.get(guard.spec.name)
            if reading is not None and self.shift:
                reading = Reading(reading.value, number(reading.time) + self.shift, reading.good)
            together = ways[k] != 0 and ways.count(ways[k]) > 1
            found.append(guard.check(reading, now, together))
        return found

    def _advance(self, u: Array, lost: NDArray[np.bool_], now: float) -> tuple[bool, bool]:
        """Bring the model to `now`: whether it was late, whether it failed."""
        step, trend = self.exported.compiled.step_s, self.exported.trend
        if trend is not None and now - self.aged_at >= AGES_EVERY_S:
            self.stepper.retune(trend.values(self.exported.model, now))
            self.aged_at = now
        if self.origin is None or now - self.origin - self.stepper.count * step > self.settings.longest_gap_s:
            try:
                self.stepper.start(u)
            except UserError:  # these inputs give no start: stay off, try again with the next ones
                return False, True
            self.origin, self.started_at, self.settling = now, now, State.COLD
            self.hindsight = None
            if self.inherited is not None:
                self._take_over(self.inherited)
        due = math.floor((now - self.origin) / step + 1e-9) + 1 - self.stepper.count
        late = due * step > self.settings.catch_up_s
        if late:
            before, x = self.stepper.count, self.stepper.x.copy()
            fast_forward(self.exported, self.stepper, u if self.inputs is None else self.inputs, u, due - 1)
            self.settling, self.started_at, self.hindsight = State.WARM, now, None
            due -= self.stepper.count - before
            if self.settings.observe and np.isfinite(self.level).any():
                self.observer = Observer.after(self.stepper, self.stepper.x - x, self.level)
        if due <= 0:
            return False, False
        held = np.tile(
            u if self.inputs is None else self.inputs, (due, 1)
        )  # missed steps: as the inputs were
        held[-1] = u
        if self.hindsight is None and lost.any() and self.inputs is not None and self.settings.hindsight:
            self.hindsight = Hindsight(self.stepper.snapshot(), self.inputs)
        y = self.stepper.run(held)
        if self.observer is not None and not (len(y) == due and self.observer.run(held)):
            self.observer = None
        if len(y):
            if self.inherited is not None:
                self._no_bump(y[-1])
            self.predicted = y[-1]
        if len(y) == due:  # inputs that the model fails on are never held
            self.inputs = u
        self._look_back(held, lost, failed=len(y) < due)
        self.origin += (due - len(y)) * step  # steps that failed are left out, not made up for
        return late or due > 1, len(y) < due

    def _look_back(self, rows: Array, lost: NDArray[np.bool_], *, failed: bool) -> None:
        """Remember steps under replaced inputs; once none is, take them again with what is known now."""
        if self.hindsight is None:
            return
        self.hindsight.add(rows, lost)
        if failed or len(self.hindsight.rows) * self.exported.compiled.step_s > LONGEST_S:
            self.hindsight = None
        elif not lost.any():
            found = self.hindsight.replay(self.exported, self.stepper)
            self.predicted = self.predicted if found is None else found
            self.hindsight, self.observer = None, None

    def _observe(self, readings: Mapping[str, Reading], now: float) -> None:
        """After a gap: let measured errors correct the states, from the next step on."""
        self.uncertain = 0.0
        if self.observer is None or self.inputs is None or self.predicted is None:
            return
        slopes = self.observer.slopes(self.stepper, self.inputs)
        found = new_errors(self.names, readings, self.observer.counted, until=now + AHEAD_S)
        if found:
            places = dict(zip(self.names, self.places, strict=True))
            left = {places[n]: value - float(self.predicted[places[n]]) for n, value in found.items()}
            self.observer.correct(self.stepper, slopes, left)
        self.uncertain = self.observer.uncertain(slopes)
        if self.uncertain < SETTLED:
            self.observer = None

    def _change_state(
        self,
        faults: Mapping[str, Fault],
        failed: bool,
        now: float,
        *,
        enabled: bool,
        part_done: bool,
        hurry: bool,
    ) -> None:
        s, replaced = self.settings, any(fault & ~Fault.UNTRAINED for fault in faults.values())
        if replaced or failed:
            self.good_since = None
        elif self.good_since is None:
            self.good_since = now
        good = self.good_since is not None and (hurry or now - self.good_since >= s.recover_s)
        settled = self.settling if now - self.started_at < s.settle_s else State.ACTIVE
        held = (
            max(now - guard.held_at for guard in self.guards) if replaced and self.origin is not None else 0.0
        )
        if not enabled:
            self.state = State.OFF
        elif self.origin is None:
            pass
        elif failed:
            self._fail(now, part_done=part_done)
        elif held > s.hold_limit_s:
            self.since = self.since if self.state is State.FAULT else now
            self.state = State.FAULT
        elif self.state is State.FAULT and good:
            self.settling, self.started_at = State.WARM, now
            self.state = State.WARM if s.settle_s > 0.0 else State.ACTIVE
        elif self.state is not State.FAULT:
            recovering = self.state in TROUBLE and not good
            self.state = State.DEGRADED if replaced or recovering else settled

    def _fail(self, now: float, *, part_done: bool) -> None:
        """Hold the output and ramp it out, because the model gave no number. In FAULT the model starts
        again in the end.
        """
        if self.state is State.FAULT:
            if now - self.since > self.settings.freeze_limit_s:  # its state may be what fails
                self.origin, self.since = None, now
            return
        if self.state is not State.FROZEN:
            self.state, self.since = State.FROZEN, now
        if part_done or now - self.since > self.settings.freeze_limit_s:
            self.state, self.since = State.FAULT, now

    def _move(self, elapsed: float) -> int:
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
                target = self.bump[k] - self.gain * float(self.predicted[place])
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

    def _tell_accepted(self, now: float) -> None:
        for guard in self.guards:
            if guard.accepted:
                stayed = f"{guard.spec.name} stepped to {guard.held:.4g} {guard.spec.unit} and stayed there"
                self.events.append(Event(now, "step accepted", stayed))

    def _tell_gain(self, gain: float, now: float) -> None:
        if (gain < 1.0) is not (self.gain < 1.0):
            far = [g.spec.name for g in self.guards if g.held is not None and g.gain(g.held) < 1.0]
            cause = (
                f"{', '.join(far)} far outside of the training" if far else "inputs are back in the training"
            )
            remedy = "check the units; if they are right, record there and fit the model again" if far else ""
            self.events.append(Event(now, "gain falls" if far else "full gain", cause, remedy))
        self.gain = gain

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
        """An operator has looked: steps that wait are accepted with the next readings, and good inputs end
        a FAULT at once.
        """
        self.acknowledged = True
        for guard in self.guards:
            guard.accept()
