"""What the log of a machine shows: rows of inputs, readings where they were taken, noise; and its file.

Channels that are held between stamps are means over the row, as a controller logs them: sampled at an
instant, an input that switches within the row would look like physics. Temperatures are the value at the
stamp.
"""

from __future__ import annotations

import gzip
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discovery.recordings.roles import ROLES
from discovery.virtual.machine import Channel, Machine, Pace
from discovery.virtual.network import Array
from discovery.virtual.signals import Draw, noise
from discovery.virtual.simulate import Run

Columns = dict[str, Array]
"""Columns of a recording by channel, `time` [s] first; NaN: not measured at that instant."""


@dataclass(frozen=True)
class Chain:
    """White noise of a reading, slow noise as a share of it, and its correlation time."""

    white: float = 0.5  # times the `sd` of the channel
    slow: float = 0.0
    slow_tau_s: float = 7200.0


def reading_instants(rng: Draw, pace: Pace, gaps: tuple[float, float]) -> Array:
    """Instants [s] of the readings of a recording on the grid of the plant, the first at 0."""
    low, high = gaps
    count = int(pace.hours * 3600.0 / low) + 1
    drawn = np.maximum(1, np.round(rng.uniform(low, high, count) / pace.step_s))
    at = np.concatenate([[0.0], np.cumsum(drawn)]) * pace.step_s
    return np.asarray(at[at <= pace.hours * 3600.0 - pace.log_s])


def observe(machine: Machine, run: Run, first: int, at: Array, rng: Draw, chain: Chain | None) -> Columns:
    """The log of a run from its step `first` on.

    Args:
        at: instants of the readings [s] after that.
        chain: None: outputs without noise, at the same instants and with the same inputs.
    """
    step, per = run.step_s, round(machine.pace.log_s / run.step_s)
    rows = (run.steps - first) // per
    stamps = np.arange(rows, dtype=np.float64) * machine.pace.log_s
    inputs, reading = rng.spawn(2)
    time = np.union1d(stamps, at)
    columns: Columns = {"time": time}
    for channel in machine.channels:
        if channel.series is None:
            continue
        series = np.asarray(channel.series(run))[first : first + rows * per]
        if ROLES[channel.role].between == "linear":
            value = series[::per] + inputs.normal(0.0, channel.sd, rows)
        else:
            value = series.reshape(rows, per).mean(axis=1)
        columns[channel.name] = _placed(time, stamps, value)
    truth = machine.read(run)[first + np.round(at / step).astype(int)]
    for j, channel in enumerate(c for c in machine.channels if c.series is None):
        value = truth[:, j]
        if chain:
            sd = chain.white * channel.sd
            slow = noise(reading, rows, machine.pace.log_s, chain.slow_tau_s, chain.slow * sd)
            value = value + np.interp(at, stamps, slow) + reading.normal(0.0, sd, len(at))
        columns[channel.name] = _placed(time, at, value)
    return columns


def _placed(time: Array, at: Array, values: Array) -> Array:
    """`values` at the instants `at`, empty elsewhere."""
    column = np.full(len(time), np.nan)
    column[np.searchsorted(time, at)] = values
    return column


def csv_gz(columns: Columns, decimals: Mapping[str, int], origin: str | None = None) -> bytes:
    """The recording as gzip CSV, without name and date in the header: the same bytes every time.

    Args:
        origin: ISO 8601 instant of time 0; None: stamps in seconds.
    """
    cells = [
        _stamps(values, origin) if name == "time" and origin else _numbers(values, decimals.get(name, 2))
        for name, values in columns.items()
    ]
    text = ",".join(columns) + "\n" + "\n".join(map(",".join, zip(*cells, strict=True))) + "\n"
    buffer = io.BytesIO()
    with gzip.GzipFile(filename="", mode="wb", fileobj=buffer, mtime=0, compresslevel=9) as file:
        file.write(text.encode())
    return buffer.getvalue()


def _numbers(values: Array, decimals: int) -> list[str]:
    return ["" if math.isnan(v) else f"{v:.{decimals}f}" for v in values.tolist()]


def _stamps(seconds: Array, origin: str) -> list[str]:
    stamps = np.datetime64(origin, "ms") + np.round(1000.0 * seconds).astype("timedelta64[ms]")
    return [str(s) for s in stamps]


def decimals(channels: Sequence[Channel]) -> dict[str, int]:
    """Digits behind the point, by column."""
    return {"time": 0} | {c.name: c.decimals for c in channels}
