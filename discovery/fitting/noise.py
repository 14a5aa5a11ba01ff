"""Noise of a residual: white reading noise, slow sensor noise, and small random heat at the bodies.
`kalman.py` whitens it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLOW_TIME = 2 * 3600.0  # s, time constant of slow sensor noise
HEAT_TIME = 3 * 3600.0  # s, time constant of small random heat


@dataclass(frozen=True)
class Noise:
    """Standard deviations: white (Y,) and slow (Y,) in the unit of each output, process noise of the states.

    A lumped model errs the more the more flows: the process noise of a state is the root of `heat`^2 (W, or
    a rate per time unit) and (`share` times what flows through the state)^2, at each instant. States that
    `heat` does not hold have none, those of `force` a heat and a share of their own.
    """

    outputs: tuple[str, ...]
    white: tuple[float, ...]
    slow: tuple[float, ...] = ()
    heat: Mapping[str, float] | None = None
    share: float = 0.0
    force: Mapping[str, tuple[float, float]] | None = None
    slow_time: float = SLOW_TIME
    heat_time: float = HEAT_TIME
    form: float = 0.0  # share by which a law of the model is off at an operating point, whenever it is there
    edge: float = 0.0  # share of a flow that enters a neighbour of its body, or shows before all of its body
    jitter: float = 0.0  # of single switches of inputs that may be logged late, as a share of `Grid.unsure`
    rough: float = 0.0  # noise of the recorded inputs, as a share of `Grid.noisy`

    @property
    def is_white(self) -> bool:
        """Whether it is nothing but reading noise."""
        return not (any(self.slow) or any((self.heat or {}).values()) or self.jitter or self.rough)


def white_noise(
    outputs: Sequence[str],
    stated: Mapping[str, float | None],
    residuals: Sequence[Array],
    least: Sequence[float] = (),
) -> Noise:
    """White noise with the stated standard deviations; where none is stated, that of the residuals (or
    readings), though no less than `least`.
    """
    white = []
    for j, (name, floor) in enumerate(zip(outputs, least or [1e-9] * len(outputs), strict=True)):
        series = np.concatenate([r[:, j][np.isfinite(r[:, j])] for r in residuals])
        found = float(np.sqrt(np.mean(series**2))) if len(series) else 1.0
        white.append(float(stated.get(name) or max(found, floor)))
    return Noise(tuple(outputs), tuple(white))


def roughness(readings: Sequence[Array]) -> float:
    """Standard deviation of white noise, by second differences of consecutive readings (R,) and their median.

    Of x[k-1] - 2 x[k] + x[k+1] white noise makes sqrt(6) times its own; what moves slowly makes nothing.
    """
    second = [np.diff(y[np.isfinite(y)], 2) for y in readings]
    size = np.abs(np.concatenate(second))
    return float(np.median(size) / 0.6745 / np.sqrt(6)) if len(size) else 0.0


def resolution(readings: Sequence[Array]) -> tuple[float, ...]:
    """Noise from the resolution of each channel, by (R, Y) readings: step/sqrt(12).

    A sensor that stands still or shows whole degrees says no more than that, however well a model meets it.
    """
    out = []
    for j in range(readings[0].shape[1]):
        shown = np.unique(np.concatenate([r[:, j][np.isfinite(r[:, j])] for r in readings]))
        size = float(np.abs(shown).max(initial=0.0))
        steps = np.diff(shown)
        steps = steps[steps > 1e-9 * size]  # not the last digits of a conversion
        out.append(float(steps.min(initial=np.inf)) if len(steps) else 1e-3 * size or 1e-9)
    return tuple(step / float(np.sqrt(12)) for step in out)


def readings_as_one(residuals: Sequence[Array]) -> float:
    """How many readings in a row say the same thing once: 1 where residuals (R, Y) (or what a noise model
    leaves of them) are white, up to R where what the model lacks lasts a whole recording.

    The integrated autocorrelation time, 1 + 2 sum rho(k), about zero and not about the mean, over the lags
    before rho falls to the noise of its estimate (Sokal, Monte Carlo methods in statistical mechanics, 1997,
    section 3).
    """
    longest = max(len(r) for r in residuals)
    products = np.zeros(longest)
    for j in range(residuals[0].shape[1]):
        read = np.concatenate([r[np.isfinite(r[:, j]), j] for r in residuals])
        if not len(read):
            continue
        size = np.sqrt(np.mean(read**2))
        for r in residuals:
            z = np.nan_to_num(np.clip(r[:, j] / max(size, 1e-300), -4.0, 4.0))
            power = np.abs(np.fft.rfft(z, 2 * len(z))) ** 2  # padded: no reading meets one before the first
            products[: len(z)] += np.fft.irfft(power)[: len(z)]
    count = sum(int(np.isfinite(r).sum()) for r in residuals)
    rho = products / max(products[0], 1e-300)
    end = int(np.argmax(rho < 2.0 / np.sqrt(max(count, 1)))) or longest
    return float(min(1.0 + 2.0 * np.sum(rho[1:end]), longest))
