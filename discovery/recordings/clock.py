"""Stamps: seconds, or ISO 8601 instants, as seconds."""

from collections.abc import Sequence
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def is_instant(text: str) -> bool:
    """Whether a stamp is meant as an instant (2026-03-01T08:00:00) and not as seconds.

    >>> is_instant("2026-03-01T08:00:00Z"), is_instant("86400.0")
    (True, False)
    """
    return text.count("-") >= 2 or ":" in text


def parse_instant(text: str) -> datetime:
    """An ISO 8601 instant. Raises ValueError for any other text."""
    return datetime.fromisoformat(text.strip())


def seconds_between(instants: Sequence[datetime]) -> Array:
    """Seconds since the first instant, (T,).

    Instants with and without a zone cannot be compared: raises ValueError.
    """
    if not instants:
        return np.zeros(0)
    first = instants[0]
    try:
        return np.array([(instant - first).total_seconds() for instant in instants])
    except TypeError:
        raise ValueError("some stamps name a time zone and others do not") from None
