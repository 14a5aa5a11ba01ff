"""Events: what happened to a compensation, why, and what to do. Each is reported once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from discovery.export.document import Input
from discovery.export.guarding import CONFIRM_S, FAR_S
from discovery.runtime.guards import Fault, InputGuard, Reading

EPOCH_FROM = 1e8  # s: a time beyond is an instant, below it is the time since the start of a recording


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened at `time` [s]; `remedy` is empty where nothing is to be done."""

    time: float
    what: str
    cause: str
    remedy: str = ""

    def __str__(self) -> str:
        text = f"{instant(self.time)} {self.what}: {self.cause}"
        return f"{text}; {self.remedy}" if self.remedy else text


def instant(time: float) -> str:
    """A time in words.

    >>> instant(1.7e9), instant(5400.0), instant(20.0)
    ('2023-11-14 22:13:20Z', '1.50 h', '20 s')
    """
    if not EPOCH_FROM <= time < 2e11:
        return f"{time / 3600.0:.2f} h" if abs(time) >= 60.0 else f"{time:.3g} s"
    return datetime.fromtimestamp(time, UTC).strftime("%Y-%m-%d %H:%M:%SZ")


def why(guard: InputGuard, fault: Fault, reading: Reading | None) -> tuple[str, str]:
    """Cause and remedy of a fault of an input."""
    spec, r, value = guard.spec, guard.spec.range, reading.value if reading is not None else None
    name, shown = spec.name, said(spec, value)
    match fault & ~Fault.UNTRAINED:
        case Fault.NOT_FINITE:
            return f"{name} has no reading", f"check the sensor of {name} and its cable"
        case Fault.QUALITY:
            return f"the source marks {name} as bad", f"check the sensor of {name} and its cable"
        case Fault.AGE:
            old = f"{name} has been {shown} without any change, or is older than {r.age_s:g} s"
            return old, "check that the source is alive and that its clock is right"
        case Fault.IMPLAUSIBLE:
            limits = f"{r.plausible_low:g} to {r.plausible_high:g} {spec.unit}"
            return f"{name} is {shown}, outside of {limits}", "check the sensor and its unit"
        case Fault.JUMP:
            far = r.sudden is not None and isinstance(value, float) and guard.held is not None
            hours = FAR_S if far and abs(value - guard.held) > (r.sudden or 0.0) else CONFIRM_S  # type: ignore[operator]
            return (
                f"{name} stepped from {said(spec, guard.held)} to {shown}",
                f"it is accepted once it has stayed for {hours / 60:g} min, or when an operator "
                "acknowledges it",
            )
        case Fault.NONE:
            return f"{name} is good again", ""
        case _:
            return f"{name} is {shown}", ""


@dataclass(frozen=True, slots=True)
class Change:
    """A change of state by names. `failed`: the model gave no number; `switched_on`: by the operator."""

    before: str
    after: str
    failed: bool = False
    switched_on: bool = False


TROUBLE = ("DEGRADED", "FROZEN", "FAULT")


def state_event(
    change: Change,
    guards: Sequence[InputGuard],
    faults: Mapping[str, Fault],
    readings: Mapping[str, Reading],
    now: float,
) -> Event:
    """Event of a change of state: what is wrong with which input, and what to do."""
    found = [
        why(guard, faults[guard.spec.name], readings.get(guard.spec.name))
        for guard in guards
        if faults[guard.spec.name] & ~Fault.UNTRAINED
    ]
    causes, remedies = [cause for cause, _ in found], [remedy for _, remedy in found]
    if change.failed:
        causes.append("the model gives no finite number for these inputs")
        remedies.append("check the inputs; export the model again if they are right")
    if change.after == "OFF":
        causes, remedies = ["compensation is switched off"], []
    elif not causes:
        causes = [_calm(change)]
    if change.after == "FAULT":
        remedies.append("it ends by itself once the inputs are good, or when an operator acknowledges it")
    what = f"{change.before} -> {change.after}"
    return Event(now, what, ", ".join(causes), "; ".join(dict.fromkeys(remedies)))


def _calm(change: Change) -> str:
    """Return why the state changes although nothing is wrong."""
    if change.before in TROUBLE:
        return "the inputs are good again"
    if change.switched_on:
        return "compensation is switched on"
    return {
        "COLD": "the model starts without a saved state",
        "WARM": "the model went through a gap",
    }.get(change.after, "the settling time is over")


def said(spec: Input, value: object) -> str:
    """A value with its unit, as an event gives it."""
    if isinstance(value, float):
        return f"{value:.4g} {spec.unit}"
    return "without a value" if value is None else repr(value)[:40]
