"""A new model runs in the shadow of the old one before it may take its place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from discovery.export.document import Exported
from discovery.printed import counted
from discovery.runtime.compensator import AHEAD_S, Compensator, Settings, State
from discovery.runtime.guards import Reading
from discovery.runtime.measured import new_errors


@dataclass(frozen=True)
class Rule:
    """When a shadow run is passed: `least_readings` measured errors decide by their residual. With fewer the
    new model is refused, for a small difference on a quiet day does not say which model is right; unless
    `most_um` allows a difference of so much without measured errors."""

    hours: float = 24.0
    least_readings: int = 5
    worse: float = 1.05
    most_um: float | None = None


@dataclass
class Shadow:
    """A candidate in the shadow of the model at work: the same readings, but its offsets are not used."""

    compensator: Compensator
    rule: Rule
    began: float | None = None
    difference: float = 0.0
    trouble: bool = False
    residuals: dict[str, list[tuple[float, float]]] = field(default_factory=dict)  # old, new
    counted: dict[str, float] = field(default_factory=dict)  # instant [s] of the last reading of each error

    def tick(self, active: Compensator, readings: Mapping[str, Reading], now: float) -> None:
        """Follow a tick of the model at work; errors may be among the readings.

        A measured error counts once, where it is good. It counts as uncompensated; where the machine was
        compensated, `NAME_applied` says by how much, and is added.
        """
        if self.began is None and active.predicted is not None:
            self.began = now
            self.compensator.succeed(active.states(), dict(zip(active.names, active.offsets, strict=True)))
        if self.began is None:
            return
        found = self.compensator.tick(readings, now)
        failed = found.state in (State.FROZEN, State.FAULT)
        self.trouble |= failed and active.state is not found.state  # inputs that are missing fail both
        old, new = predictions(active), predictions(self.compensator)
        both = old.keys() & new.keys()
        for name in both:
            self.difference = max(self.difference, abs(old[name] - new[name]))
        errors = new_errors(both, readings, self.counted, since=self.began, until=now + AHEAD_S)
        for name, error in errors.items():
            self.residuals.setdefault(name, []).append((error - old[name], error - new[name]))

    def verdict(self, now: float) -> tuple[bool, str] | None:
        """Whether the candidate may take over, and why; None: not yet known."""
        if self.trouble:
            return False, "the new model failed in its shadow run"
        if self.began is None or now - self.began < self.rule.hours * 3600.0:
            return None
        count = sum(len(pairs) for pairs in self.residuals.values())
        if count >= self.rule.least_readings:
            old, new = self._rms(0), self._rms(1)
            rms = f"{new:.2f} with the new model, {old:.2f} with the old one"
            text = f"rms of {counted(count, 'measured error')} {rms}"
            return new <= self.rule.worse * old, text
        if self.rule.most_um is None:
            came = counted(count, "measured error")
            return False, f"only {came} came, {self.rule.least_readings} are needed"
        text = f"the two models differ by at most {self.difference:.2f} um"
        return self.difference <= self.rule.most_um, text

    def _rms(self, which: int) -> float:
        """The rms of the residuals. A constant error left counts: for a day, wear looks like one."""
        squares = [pair[which] ** 2 for pairs in self.residuals.values() for pair in pairs]
        return math.sqrt(sum(squares) / max(len(squares), 1))


def predictions(compensator: Compensator) -> dict[str, float]:
    """Predicted errors by name; none before the first step."""
    if compensator.predicted is None:
        return {}
    return {
        n: float(compensator.predicted[k]) for n, k in zip(compensator.names, compensator.places, strict=True)
    }


def begin_shadow(candidate: Exported, settings: Settings, rule: Rule | None = None) -> Shadow:
    """A shadow run of a candidate."""
    return Shadow(Compensator(candidate, settings), rule or Rule())


def take_over(old: Compensator, new: Compensator) -> Compensator:
    """The new model at work: its offsets begin where the old ones are, the difference fades."""
    before = dict(zip(old.names, old.offsets, strict=True))
    new.offsets = [before.get(name, 0.0) for name in new.names]
    if new.predicted is not None:
        new.bump = [o + float(new.predicted[k]) for o, k in zip(new.offsets, new.places, strict=True)]
    new.heartbeat, new.state, new.since = old.heartbeat, old.state, old.since
    return new
