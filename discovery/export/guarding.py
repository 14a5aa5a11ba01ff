"""The numbers of guards, limits and fades: the same in the runtime, in C, in an FMU and in structured text.

A target without a clock of its own ticks once every step of the model. What it carries is
`discovery.runtime.guards` and `discovery.runtime.compensator` under such ticks, and tests hold it to that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from discovery.export.document import Exported, Input, Output

TEMPERATURE_SPAN = 5.0  # K beyond the trained range that half of the fade covers at least
FADE_FROM, FADE_TO = 0.5, 2.0  # spans beyond the trained range at which the gain begins to fall, and is 0
CONFIRM_S = 300.0  # a step that physics allows is accepted once it has stayed for so long
TOGETHER = 0.2  # share of that time where another input steps the same way at the same time
FAR_S = 4 * 3600.0  # ... and so long where physics does not allow it
FURTHER = 1.25  # times as far outside the training as before: a new step of a held input
MEAN_S = 1800.0  # s over which a held input is averaged; after `age` the mean stands in for it, not a moment
LEAK = 0.2  # seconds forgotten for each second in which a held input is back inside its training
CONSTANTS = {  # as the templates of the targets name them
    "FADE_FROM": FADE_FROM,
    "FADE_TO": FADE_TO,
    "CONFIRM_S": CONFIRM_S,
    "TOGETHER": TOGETHER,
    "FAR_S": FAR_S,
    "FURTHER": FURTHER,
    "MEAN_S": MEAN_S,
    "LEAK": LEAK,
}


@dataclass(frozen=True)
class Times:
    """Times of the states in s."""

    hold_limit_s: float = 4 * 3600.0  # longest replacement of an input
    freeze_limit_s: float = 2 * 3600.0  # longest hold of the outputs where the model fails
    recover_s: float = 300.0  # inputs are good for so long before DEGRADED or FAULT ends
    settle_s: float = 8 * 3600.0  # COLD and WARM last as long


@dataclass(frozen=True)
class GuardNumbers:
    """Numbers of the guard of one input, in its unit; -1 where the document has none."""

    low: float
    high: float
    span: float
    plausible_low: float
    plausible_high: float
    step: float
    rate: float
    age: float
    sudden: float
    still: float


MEANING = {
    "low": "trained from",
    "high": "trained to",
    "span": "distance outside the training that counts as one",
    "plausible_low": "plausible from",
    "plausible_high": "plausible to",
    "step": "largest usual step between two readings, -1: any",
    "rate": "usual drift per s, added to the step",
    "age": "s after which a value is too old",
    "sudden": "largest step that physics allows within minutes, -1: any",
    "still": "s that a value may stand exactly still, -1: for ever",
    "limit": "largest offset",
    "rate_of_offset": "largest change of the offset per s",
    "hold_limit_s": "s that an input may be replaced",
    "freeze_limit_s": "s that offsets are held where the model fails",
    "recover_s": "s that inputs are good before DEGRADED or FAULT ends",
    "settle_s": "s that COLD and WARM last",
}


def span(spec: Input) -> float:
    """Distance from the trained range that counts as one span: its width, of a temperature at least 5 K, of
    anything else at least its size.
    """
    r = spec.range
    least = TEMPERATURE_SPAN if spec.unit == "degC" else max(abs(r.low), abs(r.high), 1e-9)
    return max(r.high - r.low, least)


def guard_numbers(spec: Input) -> GuardNumbers:
    """The numbers of an input as targets carry them."""
    r = spec.range

    def known(value: float | None) -> float:
        return -1.0 if value is None else value

    return GuardNumbers(
        r.low,
        r.high,
        span(spec),
        max(r.plausible_low, -1e29),
        min(r.plausible_high, 1e29),
        known(r.step),
        r.rate or 0.0,
        r.age_s,
        known(r.sudden),
        known(r.still_s),
    )


def times() -> dict[str, float]:
    """The times of the states by name."""
    return asdict(Times())


def compensated(exported: Exported) -> list[int]:
    """Which outputs are compensated: those of role `error`."""
    return [k for k, output in enumerate(exported.outputs) if output.role == "error"]


def without_offsets(outputs: Sequence[Output]) -> list[str]:
    """A sentence where no output is an error, so that nothing can be compensated; else none."""
    if any(output.role == "error" for output in outputs):
        return []
    names = ", ".join(output.name for output in outputs)
    temperatures = all(output.role == "temperature" for output in outputs)
    what = "are temperatures" if temperatures else "are no errors"
    return [f"nothing compensates an error, there are no offsets: the outputs {what} ({names})"]
