"""What the recordings of a fit say about the inputs and outputs a runtime will meet: ranges, steps, rates,
limits.

Limits come from data, never from a guess: a rate limit that is too tight alone costs more than many a fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.compiled import Compiled
from discovery.export.stepper import free_run
from discovery.printed import lasting
from discovery.recordings import Campaign, sample_input
from discovery.recordings.roles import ROLES

Array = NDArray[np.float64]

STEP_MARGIN = 3.0  # times the largest step between samples that the recordings hold
LIMIT_MARGIN = 1.5  # times the largest output
RATE_MARGIN = 2.0  # times the fastest output
AGES = 5.0  # times the usual spacing of the samples until a value is too old
STILL_MARGIN, STILL_LEAST_S = 5.0, 3600.0  # times the longest stretch in which a temperature stood still
WIDE = 10.0  # times the size of an input in its training: what a machine may do beyond it
# Largest step [K] that physics allows within minutes: a hall door, a chiller, a tank filled up with cold
# fluid.
SUDDEN = {"ambient temperature": 8.0, "fluid temperature": 12.0, "coolant temperature": 12.0}


@dataclass(frozen=True)
class InputRange:
    """Of one input, in its unit: trained range, physically plausible range, largest step between two samples
    beyond what `rate` [1/s] explains, and the age [s] at which a value is too old. `step` is None where any
    step is normal. `sudden`: largest step that physics allows within minutes (None: any). `still_s`:
    longest time [s]
    that a value may stand exactly still; None: for ever."""

    low: float
    high: float
    plausible_low: float
    plausible_high: float
    step: float | None
    rate: float | None
    age_s: float
    sudden: float | None = None
    still_s: float | None = None


@dataclass(frozen=True)
class OutputRange:
    """Of one output, in its unit: largest offset and largest rate [1/s] that a runtime may give."""

    limit: float
    rate: float


def sampled_inputs(campaign: Campaign, recording: str, inputs: Sequence[str], step_s: float) -> Array:
    """Inputs (K, U) as a runtime reads them: at the beginning of each step of a recording.

    Raises:
        UserError: an input that the recording does not hold.
    """
    data = campaign.recordings[recording]
    at = np.arange(0.0, data.time[-1], step_s)
    columns = []
    for name in inputs:
        channel = campaign.channels.get(name)
        values = (
            sample_input(data, channel, at)
            if channel is not None and name in data.values
            else np.array([np.nan])
        )
        if channel is None or not np.isfinite(values).all():
            raise UserError(
                f"{campaign.path}: recording '{recording}' has no value of '{name}', which "
                "the model needs as an input"
            )
        columns.append(values)
    return np.column_stack(columns) if columns else np.zeros((len(at), 0))


def input_range(campaign: Campaign, recordings: Sequence[str], name: str) -> InputRange:
    """Range of an input over the recordings of the fit."""
    channel = campaign.channels[name]
    series, steps, rates, gaps, still = [], [0.0], [0.0], [1.0], [0.0]
    for recording in recordings:
        data = campaign.recordings[recording]
        known = np.isfinite(data.values[name])
        value, time = data.values[name][known], data.time[known]
        series.append(value)
        if len(value) > 1:
            steps.append(float(np.max(np.abs(np.diff(value)))))
            gaps.append(float(np.median(np.diff(time))))
            still.append(_longest_still(time, value))
            window = max(1, int(900.0 / max(gaps[-1], 1e-9)))  # over 15 min noise no longer counts as a rate
            if len(value) > window:
                rates.append(
                    float(np.max(np.abs(value[window:] - value[:-window]) / (time[window:] - time[:-window])))
                )
    together = np.concatenate(series)
    low, high = float(together.min()), float(together.max())
    usual = next((r.usual for unit, r in ROLES[channel.role].ranges.items() if unit == channel.unit), None)
    span = max(high - low, 1e-9)
    plausible = usual or (low - WIDE * span, high + WIDE * span)
    straight = channel.between == "linear"
    size = max(high - low, abs(low), abs(high))
    if usual and not straight and size > 0.0:  # of a machine that takes 1 kW, 50 kW are a fault
        plausible = max(usual[0], low - WIDE * size), min(usual[1], high + WIDE * size)
    moves = high > low and max(still) < 0.5 * max(float(campaign.recordings[r].time[-1]) for r in recordings)
    return InputRange(
        low,
        high,
        min(plausible[0], low),
        max(plausible[1], high),
        STEP_MARGIN * max(steps) if straight else None,
        STEP_MARGIN * max(rates) if straight else None,
        AGES * max(gaps),
        SUDDEN.get(channel.role, STEP_MARGIN * span) if straight else None,
        max(STILL_MARGIN * max(still), STILL_LEAST_S) if straight and moves else None,
    )


def _longest_still(time: Array, value: Array) -> float:
    """Longest time [s] in which a series does not change at all."""
    edges = np.flatnonzero(np.diff(value))
    marks = np.concatenate([[time[0]], time[edges + 1], [time[-1]]])
    return float(np.max(np.diff(marks)))


def output_ranges(
    compiled: Compiled, campaign: Campaign, recordings: Sequence[str]
) -> dict[str, OutputRange]:
    """Limits of the outputs from free runs of the model over the recordings of the fit."""
    size = np.zeros(len(compiled.outputs))
    rate = np.zeros(len(compiled.outputs))
    for recording in recordings:
        inputs = sampled_inputs(campaign, recording, compiled.inputs, compiled.step_s)
        y = free_run(compiled, inputs)
        if len(y) < len(inputs):
            raise UserError(
                f"model '{compiled.name}' diverges after {lasting(len(y) * compiled.step_s)} of "
                f"recording '{recording}' with a fixed step of {compiled.step_s:g} s; check the model or "
                "export with a shorter --step"
            )
        size = np.maximum(size, np.max(np.abs(y), axis=0))
        rate = np.maximum(rate, np.max(np.abs(np.diff(y, axis=0)), axis=0, initial=0.0) / compiled.step_s)
    return {
        name: OutputRange(max(LIMIT_MARGIN * float(size[i]), 1.0), max(RATE_MARGIN * float(rate[i]), 1e-3))
        for i, name in enumerate(compiled.outputs)
    }
