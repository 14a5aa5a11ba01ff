"""Faults of the measuring chain: they change the recording, not the machine. One function each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from discovery.errors import UsageError
from discovery.virtual.machine import ERRORS
from discovery.virtual.measurement import CHANNELS, Columns

DAY = 86400.0


def sensor_offset(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    """One direction of the R-Test jumps by `size` at `at_s` and stays there."""
    return columns | {channel: columns[channel] + size * (columns["time"] >= at_s)}


def sensor_drift(columns: Columns, channel: str, size: float, at_s: float = 0.0) -> Columns:
    """A channel creeps by `size` a day from `at_s` on."""
    return columns | {channel: columns[channel] + size * np.maximum(0.0, columns["time"] - at_s) / DAY}


def sensor_lag(columns: Columns, channel: str, size: float, at_s: float = 0.0) -> Columns:
    """A temperature sensor follows with a time constant of `size` seconds (`at_s` is not used)."""
    from scipy.signal import lfilter

    del at_s
    known = np.flatnonzero(~np.isnan(columns[channel]))
    values = columns[channel][known]
    step = float(np.median(np.diff(columns["time"][known])))
    keep = float(np.exp(-step / size)) if size > 0 else 0.0
    late = lfilter([1 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0]
    column = columns[channel].copy()
    column[known] = late
    return columns | {channel: column}


def outlier(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    """One single reading, the first at or after `at_s`, is wrong by `size`."""
    hits = np.flatnonzero(~np.isnan(columns[channel]) & (columns["time"] >= at_s))
    column = columns[channel].copy()
    column[hits[:1]] += size
    return columns | {channel: column}


def clock_shift(columns: Columns, channel: str, size: float, at_s: float = 0.0) -> Columns:
    """The clock of the R-Test is `size` seconds ahead of the log of the inputs (the rest is not used)."""
    del channel, at_s
    inputs = [name for name in columns if name not in (*ERRORS, "time")]
    errors = [name for name in columns if name in ERRORS]
    time = columns["time"]
    logged = np.flatnonzero(~np.isnan(columns[inputs[0]]))
    read = np.flatnonzero(~np.isnan(columns[errors[0]]))
    shifted = time[read] + size
    inside = (shifted >= time[0]) & (shifted <= time[-1])
    read, shifted = read[inside], shifted[inside]
    merged = np.union1d(time[logged], shifted)
    result: Columns = {"time": merged}
    for name in columns:
        if name != "time":
            rows, at = (read, shifted) if name in errors else (logged, time[logged])
            result[name] = np.full(len(merged), np.nan)
            result[name][np.searchsorted(merged, at)] = columns[name][rows]
    return result


def rezero(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    """The R-Test is set to zero anew: the errors jump at `at_s` by `size` times 1, -1, 0.5, -2."""
    del channel
    jumped = dict(columns)
    for name, share in zip(ERRORS, (1.0, -1.0, 0.5, -2.0), strict=True):
        jumped = sensor_offset(jumped, name, size * share, at_s)
    return jumped


Fault = Callable[[Columns, str, float, float], Columns]
FAULTS: dict[str, tuple[Fault, str, str, float]] = {
    # name: function, default channel, unit of the size, example size
    "sensor_offset": (sensor_offset, "E_Z0T", "um", 4.0),
    "sensor_drift": (sensor_drift, "E_R0T", "um a day", 1.2),
    "sensor_lag": (sensor_lag, "T_fluid", "s", 1200.0),
    "outlier": (outlier, "E_A0C", "um", 60.0),
    "clock_shift": (clock_shift, "", "s", 900.0),
    "rezero": (rezero, "", "um", 5.0),
}


def parse_fault(text: str) -> tuple[str, str, float]:
    """Read `name[@channel]=size`.

    Raises UsageError: an unknown name or channel, a size that is no number.
    """
    head, _, size_text = text.partition("=")
    name, _, channel = head.strip().partition("@")
    if name not in FAULTS:
        raise UsageError(f"There is no fault '{name}' in '{text}'; choose one of: {', '.join(FAULTS)}.")
    channel = channel or FAULTS[name][1]
    if channel and channel not in CHANNELS:
        raise UsageError(f"There is no channel '{channel}' in '{text}'; choose from: {', '.join(CHANNELS)}.")
    try:
        size = float(size_text)
    except ValueError:
        size = float("nan")
    if not np.isfinite(size):
        _, _, unit, example = FAULTS[name]
        raise UsageError(f"The fault '{text}' needs a size in {unit}, for example {name}={example:g}.")
    return name, channel, size
