"""Faults of the measuring chain: they change the recording, not the machine. One function each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from discovery.virtual.log import Columns
from discovery.virtual.network import Array

DAY = 86400.0


def sensor_offset(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    """A reading jumps by `size` at `at_s` and stays there."""
    return columns | {channel: columns[channel] + size * (columns["time"] >= at_s)}


def sensor_drift(columns: Columns, channel: str, size: float, at_s: float = 0.0) -> Columns:
    """A channel creeps by `size` a day from `at_s` on."""
    return columns | {channel: columns[channel] + size * np.maximum(0.0, columns["time"] - at_s) / DAY}


def sensor_gain(columns: Columns, channel: str, size: float, about: str = "") -> Columns:
    """A sensor shows too much by a share: of its value, or of what it is above another channel."""
    zero = columns[about] if about else 0.0
    return columns | {channel: columns[channel] + size * (columns[channel] - zero)}


def sensor_lag(columns: Columns, channel: str, size: float) -> Columns:
    """A sensor follows with a time constant of `size` seconds, from its own readings."""
    known = np.flatnonzero(~np.isnan(columns[channel]))
    values, time = columns[channel][known], columns["time"][known]
    late, now = np.empty_like(values), float(values[0])
    for k, value in enumerate(values.tolist()):
        gap = time[k] - time[k - 1] if k else 0.0
        now += (value - now) * (1.0 - np.exp(-gap / size)) if size > 0 else value - now
        late[k] = now
    column = columns[channel].copy()
    column[known] = late
    return columns | {channel: column}


def outlier(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    """One single reading, the first at or after `at_s`, is wrong by `size`."""
    hits = np.flatnonzero(~np.isnan(columns[channel]) & (columns["time"] >= at_s))
    column = columns[channel].copy()
    column[hits[:1]] += size
    return columns | {channel: column}


def clock_shift(columns: Columns, outputs: Sequence[str], size: float) -> Columns:
    """The clock of the readings is `size` seconds ahead of the log of the inputs."""
    inputs = [name for name in columns if name not in (*outputs, "time")]
    time = columns["time"]
    logged = np.flatnonzero(~np.isnan(columns[inputs[0]]))
    read = np.flatnonzero(~np.isnan(columns[outputs[0]]))
    shifted = time[read] + size
    inside = (shifted >= time[0]) & (shifted <= time[-1])
    read, shifted = read[inside], shifted[inside]
    merged = np.union1d(time[logged], shifted)
    result: Columns = {"time": merged}
    for name in columns:
        if name != "time":
            rows, at = (read, shifted) if name in outputs else (logged, time[logged])
            result[name] = np.full(len(merged), np.nan)
            result[name][np.searchsorted(merged, at)] = columns[name][rows]
    return result


def rezero(columns: Columns, jumps: Mapping[str, float], at_s: float) -> Columns:
    """The gauge is set to zero anew at `at_s`: every output jumps by its own value, and stays there."""
    for name, size in jumps.items():
        columns = sensor_offset(columns, name, size, at_s)
    return columns


def lagging(j: int, tau_s: float, y: Array, step_s: float) -> Array:
    """Outputs (n, Y) of which the j-th follows with `tau_s`, between readings as well."""
    from discovery.virtual.signals import lagged

    shown = y.copy()
    shown[:, j] = lagged(y[:, j], step_s, tau_s)
    return shown
