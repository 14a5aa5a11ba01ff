"""What an input may have done while nobody recorded it: in gaps, and before a recording.

A held input stands at its last value through a gap, another one runs straight. In truth it went on moving as
it does elsewhere. In the middle of a gap of length G it is off by what it moves within G/2, or by how far it
is from a straight line over G, on average over the recording (structure function; Yaglom, Correlation Theory
of Stationary and Related Random Functions, 1987):

    D = mean of (u(t + G/2) - u(t))^2,   or of (u(t + G/2) - (u(t) + u(t + G))/2)^2

Its integral over the gap then has the standard deviation G sqrt(D), as white noise of the spectral density
G D.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics.samples import Samples
from discovery.printed import spanned

Array = NDArray[np.float64]

MISSED = 3.0  # usual steps: a longer one is a gap
REGULAR = 0.9  # of the steps are usual ones, or the channel is written when it changes
_ENOUGH = 4000  # instants at which a structure function is taken ...
_LENGTHS = 8  # ... and lengths of gaps, where there are several


def unknown_in_gaps(samples: Samples) -> Samples | None:
    """How unsure a channel is in its gaps, as the root of a spectral density, in its unit per root of Hz, and
    zero elsewhere; None where it has no gap, or does not move.

    >>> time = np.append(60.0 * np.arange(20), 2340.0)  # 20 min are not recorded
    >>> power = Samples(time, np.arange(21.0) % 2, False)
    >>> unknown = unknown_in_gaps(power)
    >>> float(unknown.at(600.0)), float(unknown.at(1500.0)) > 0
    (0.0, True)
    """
    step = np.diff(samples.time)
    if step.size < 2 or not np.ptp(samples.value) > 0:
        return None
    usual = float(np.median(step))
    gaps = np.flatnonzero(step > MISSED * usual)
    if not gaps.size or np.mean(step <= MISSED * usual) < REGULAR:
        return None
    length, begin, end = step[gaps], samples.time[gaps], samples.time[gaps + 1]
    some = np.geomspace(length.min(), length.max(), _LENGTHS) if np.ptp(length) > 0 else length[:1]
    apart = np.interp(length, some, [_apart(samples, float(one)) for one in some])
    time = np.unique(np.concatenate([samples.time[:1], end, begin]))
    size = np.zeros(len(time))
    size[np.searchsorted(time, begin)] = np.sqrt(length * apart)
    return Samples(time, size, False)


def unknown_before(samples: Samples, seconds: float) -> Samples:
    """How unsure a channel that arrives late by some seconds is until what was recorded first arrives, or of
    one that arrives early, after what was recorded last; as `unknown_in_gaps`.

    >>> power = Samples(60.0 * np.arange(21.0), np.arange(21.0) % 2, False)
    >>> unknown_before(power, 300.0).at(np.array([299.0, 300.0])) > 0
    array([ True, False])
    """
    begin, end, length = float(samples.time[0]), float(samples.time[-1]), abs(seconds)
    time = np.linspace(begin, end, _ENOUGH)
    moved = samples.at(np.minimum(time + length / 2, end)) - samples.at(time)
    size = float(np.sqrt(length * np.mean(moved**2)))
    if seconds > 0:
        return Samples(np.array([begin, begin + length]), np.array([size, 0.0]), False)
    return Samples(np.array([begin, end - length]), np.array([0.0, size]), False)


def _apart(samples: Samples, gap: float) -> float:
    """Mean square by which a channel is off in the middle of a gap."""
    begin, end = float(samples.time[0]), float(samples.time[-1])
    half = min(gap / 2, (end - begin) / 3)
    time = np.linspace(begin, end - 2 * half, _ENOUGH)
    first, middle, last = (samples.at(time + by) for by in (0.0, half, 2 * half))
    return float(np.mean((middle - (0.5 * (first + last) if samples.linear else first)) ** 2))


def sentences(silent: Mapping[str, Mapping[str, Samples]]) -> list[str]:
    """A sentence for each recording with gaps. `silent`: by recording and channel, as `unknown_in_gaps`."""
    said = []
    for recording, channels in silent.items():
        gaps = {
            (float(one.time[k]), float(one.time[k + 1]))
            for one in channels.values()
            for k in np.flatnonzero(one.value)
        }
        if not gaps:
            continue
        begin, end = max(gaps, key=lambda gap: gap[1] - gap[0])
        more = f", nor in {len(gaps) - 1} more gap{'s' * (len(gaps) > 2)}" if len(gaps) > 1 else ""
        when = f"from {spanned((begin, end))}"
        did = f"what {', '.join(channels)} did in {recording} {when}"
        said.append(f"{did} is not recorded{more}; the fit allows for it")
    return said
