"""Shares with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Share:
    """`hits` of `count`, e.g. cases."""

    hits: float
    count: int

    @property
    def value(self) -> float | None:
        """The share; None of nothing."""
        return self.hits / self.count if self.count else None

    @property
    def percent(self) -> float | None:
        """The share in percent."""
        return None if self.value is None else 100 * self.value

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Exact two-sided interval of the share (Clopper & Pearson, Biometrika 26 (1934) 404).

        >>> [round(v, 4) for v in Share(1, 50).interval()]
        [0.0005, 0.1065]
        """
        from scipy.stats import beta

        if not self.count:
            return 0.0, 1.0
        k, n, tail = self.hits, self.count, (1 - level) / 2
        low = float(beta.ppf(tail, k, n - k + 1)) if k > 0 else 0.0
        high = float(beta.ppf(1 - tail, k + 1, n - k)) if k < n else 1.0
        return low, high

    def upper(self) -> float:
        """Exact one-sided upper bound of the share, 95 %.

        >>> round(Share(0, 50).upper(), 4)  # 1 - 0.05**(1/50)
        0.0582
        """
        return self.interval(0.9)[1]


def share(flags: list[bool]) -> Share:
    """How many of some flags are up.

    >>> share([True, False, True, True])
    Share(hits=3, count=4)
    """
    return Share(sum(flags), len(flags))
