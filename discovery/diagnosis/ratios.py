"""What readings say of a size that they leave open by itself: often its ratio to another parameter is known.

Where a body follows its inputs faster than readings come, heat and loss may both be of any size: the readings
show where the body settles, which is their ratio,

    sd(a/b) / (a/b) = sqrt(var(a)/a^2 + var(b)/b^2 - 2 cov(a, b)/(a b))
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discovery.diagnosis.scored import Scored
from discovery.fitting.covariance import Z95

_KNOWN = 0.5  # of itself: a ratio with a wider 95 % interval is not determined either


@dataclass(frozen=True)
class Ratio:
    """The ratio of a size to another parameter, with its 95 % interval."""

    to: str
    value: float
    low: float
    high: float


def known_ratio(model: Scored, size: str) -> Ratio | None:
    """The best known ratio of a size to another free parameter; None if none is known.

    Args:
        model: where both are free; its covariance counts.
    """
    known = model.known()
    values = {n: p.value for n, p in model.fit.model.parameters.items()}
    if size not in known.names:
        return None
    i, found = known.names.index(size), list[tuple[float, Ratio]]()
    at = np.array([values[name] or np.nan for name in known.names])
    relative = known.covariance / np.outer(at, at)
    for j, name in enumerate(known.names):
        half = Z95 * float(np.sqrt(max(relative[i, i] + relative[j, j] - 2 * relative[i, j], 0.0)))
        if name != size and half < _KNOWN:
            ratio = values[size] / values[name]
            ends = sorted((ratio * (1 - half), ratio * (1 + half)))
            found.append((half, Ratio(name, ratio, *ends)))
    return min(found, key=lambda pair: pair[0])[1] if found else None
