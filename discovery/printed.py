"""Numbers, counts and recordings as sentences print them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def printed(value: float, digits: int = 3) -> str:
    """So many digits, and a power of ten only where nobody would write the number out.

    >>> printed(174.0, 2), printed(73701.4, 4), printed(0.01234), printed(2e-9)
    ('170', '73700', '0.0123', '2e-09')
    """
    return f"{float(f'{value:.{digits}g}'):.12g}"


def counted(count: int, word: str) -> str:
    """A number of things.

    >>> counted(1, "state"), counted(3, "term")
    ('1 state', '3 terms')
    """
    return f"{count} {word}{'s' * (count != 1)}"


def lasting(seconds: float) -> str:
    """A duration as one says it.

    >>> lasting(59.6), lasting(1373.0), lasting(7200.0)
    ('60 s', '23 min', '2 h')
    """
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= size:
            return f"{printed(seconds / size, 2)} {unit}"
    return f"{printed(seconds, 2)} s"


def spanned(times: Sequence[float], digits: int = 3) -> str:
    """Instants [s] from the first on as one says them, in the unit of the last.

    >>> spanned([0.2, 20.0]), spanned([63360.0, 83880.0]), spanned([90.0])
    ('0.2 to 20 s', '17.6 to 23.3 h', '1.5 min')
    """
    last = max(times, default=0.0)
    unit, size = next((u, s) for u, s in (("h", 3600.0), ("min", 60.0), ("s", 0.0)) if last >= s)
    return f"{' to '.join(printed(t / (size or 1.0), digits) for t in times)} {unit}"


def sized(value: float, unit: str, digits: int = 3) -> str:
    """The size of an effect with its unit; without a unit it is a share.

    >>> sized(28.4, "W/K", 2), sized(0.284, "1", 2)
    ('28 W/K', '28 %')
    """
    return f"{printed(100 * value, digits)} %" if unit == "1" else f"{printed(value, digits)} {unit}"


def undetermined(low: float | None, high: float | None) -> str:
    """What is said behind the interval of the size of an effect that is sure to act: with zero in it,
    readings leave the size open, as where only its ratio to another parameter shows.

    >>> undetermined(0.0, 5.9), undetermined(1.2, 5.9)
    (', not determined', '')
    """
    return ", not determined" if low is not None and high is not None and low <= 0.0 <= high else ""


def when(claim: Mapping[str, Any]) -> str:
    """The recording in which an effect acts, or from which on it does.

    >>> when({"recording": "monday"}), when({"recording": "monday", "lasts": True})
    ('in monday', 'from monday on')
    """
    if claim.get("grows"):
        return f"from {claim['recording']} on, more in each recording"
    return f"from {claim['recording']} on" if claim.get("lasts") else f"in {claim['recording']}"
