"""Values of an input at any time, from the stamps at which it is known."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from discovery.recordings.campaign import Channel, Recording

Array = NDArray[np.float64]


def sample_input(recording: Recording, channel: Channel, at_times: ArrayLike) -> Array:
    """The input `channel` at `at_times` [s since the start of the recording], (T,), in the channel's unit.

    Held: the last known value. Linear: straight between known stamps. Before the first known stamp its value
    holds, after the last one that. NaN throughout when the input is known nowhere.

    >>> import numpy as np
    >>> channel = Channel("pump", "fluid flow", "1", None, "held")
    >>> recording = Recording("fit", np.array([0.0, 10.0]), {"pump": np.array([0.0, 1.0])})
    >>> sample_input(recording, channel, [-5.0, 9.9, 10.0, 20.0]).tolist()
    [0.0, 0.0, 1.0, 1.0]
    """
    at = np.asarray(at_times, dtype=np.float64)
    values = recording.values[channel.name]
    known = np.isfinite(values)
    if not known.any():
        return np.full(at.shape, np.nan)
    stamps, values = recording.time[known], values[known]
    if channel.between == "linear":
        return np.interp(at, stamps, values)
    held: Array = values[np.maximum(np.searchsorted(stamps, at, side="right") - 1, 0)]
    return held
