"""What the machine's log shows of a run: inputs every minute, R-Test readings where they were taken, noise.

Channels that are held between stamps (speed, flow, power) are means over the minute after the stamp, as a
controller logs them: sampled at an instant, an input that switches within the minute would look like
physics. Temperatures are the value at the stamp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.virtual.cycles import HOUR, Cycle, noise
from discovery.virtual.machine import ERRORS
from discovery.virtual.plant import Trajectory

Array = NDArray[np.float64]
Columns = dict[str, Array]
"""Columns of a recording by channel, `time` [s] first; NaN: not measured at that instant."""

INTERVAL_S = 60.0

#          role, unit, decimals
CHANNELS: dict[str, tuple[str, str, int]] = {
    "T_env": ("ambient temperature", "degC", 2),
    "T_fluid": ("fluid temperature", "degC", 2),
    "T_cool": ("coolant temperature", "degC", 2),
    "pump": ("fluid flow", "1", 3),
    "speed": ("rotation speed", "rpm", 1),
    "P_drive": ("heat load", "W", 1),
    "P_cool": ("cooling power", "W", 1),
    "h_nozzle": ("nozzle height", "mm", 0),
    "E_Y0C": ("error", "um", 2),
    "E_Z0T": ("error", "um", 2),
    "E_R0T": ("error", "um", 2),
    "E_A0C": ("error", "um/m", 2),
}


@dataclass(frozen=True)
class Chain:
    """The measuring chain in its everyday state."""

    # noise of a reading, um, um, um, um/m; mean of two turns of the table
    white: tuple[float, float, float, float] = (0.4, 0.4, 0.4, 1.0)
    slow: float = 0.3  # slow noise as a share of `white` ...
    slow_tau_s: float = 2 * HOUR  # ... and its correlation time
    heat_w: float = 1.0  # random heat at every body that no channel shows ...
    heat_tau_s: float = 3 * HOUR  # ... and its correlation time
    temperature_sd: float = 0.03  # K


def everyday_heat(rng: np.random.Generator, n: int, step_s: float, chain: Chain) -> Array:
    """Small random heat (n, 5) [W] at the bodies: people, doors, grease; no machine is without it."""
    return np.column_stack([noise(rng, n, step_s, chain.heat_tau_s, chain.heat_w) for _ in range(5)])


def observe(cycle: Cycle, run: Trajectory, rng: np.random.Generator, chain: Chain) -> Columns:
    """The recording of one run. Rows: every minute (inputs) and every reading (errors), merged by time."""
    per = round(INTERVAL_S / cycle.step_s)
    rows = len(cycle.speed) // per
    stamps = np.arange(rows, dtype=np.float64) * INTERVAL_S

    def mean(x: Array) -> Array:
        return np.asarray(x[: rows * per].reshape(rows, per).mean(axis=1))

    def sensed(x: Array) -> Array:
        return np.asarray(x[: rows * per : per] + rng.normal(0.0, chain.temperature_sd, rows))

    inputs: Columns = {
        "T_env": sensed(cycle.air),
        "T_fluid": sensed(run.fluid),
        "T_cool": sensed(run.coolant),
        "pump": mean(cycle.flow),
        "speed": mean(cycle.speed),
        "P_drive": mean(run.drive),
        "P_cool": mean(run.cooling),
        "h_nozzle": mean(1000.0 * cycle.height),
    }
    at = cycle.readings[cycle.readings <= stamps[-1]]
    values = run.errors[np.round(at / cycle.step_s).astype(int)]
    time = np.union1d(stamps, at)
    columns: Columns = {"time": time}
    for name, value in inputs.items():
        columns[name] = _spread(time, stamps, value)
    for j, name in enumerate(ERRORS):
        slow = noise(rng, rows, INTERVAL_S, chain.slow_tau_s, chain.slow * chain.white[j])
        white = rng.normal(0.0, chain.white[j], len(at))
        columns[name] = _spread(time, at, np.asarray(values[:, j] + np.interp(at, stamps, slow) + white))
    return columns


def _spread(time: Array, at: Array, values: Array) -> Array:
    """`values` at the instants `at`, empty elsewhere."""
    column = np.full(len(time), np.nan)
    column[np.searchsorted(time, at)] = values
    return column
