"""Materials and bodies: what a drawing gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

Share = tuple[str, float]
"""A node and its share of a stretch."""


class Material(NamedTuple):
    """Properties near 25 degC (VDI heat atlas, tables of D6): kg/m3, J/kg/K, W/m/K, um/m/K."""

    density: float
    heat: float
    conductivity: float
    expansion: float


STEEL = Material(7850.0, 470.0, 45.0, 11.5)
CAST_IRON = Material(7200.0, 500.0, 50.0, 10.8)
ALUMINIUM = Material(2700.0, 900.0, 160.0, 23.5)
GRANITE = Material(2900.0, 820.0, 2.8, 6.0)
MINERAL_CASTING = Material(2400.0, 900.0, 2.2, 13.0)
CERAMIC = Material(3800.0, 880.0, 28.0, 7.4)


@dataclass(frozen=True)
class Bar:
    """A body that conducts along its length, cut into equal cells, the first at 0 and the last at 1.

    `section` [m2] stores heat; `web` [m2] conducts along: ribs across the length store, and do not conduct.
    """

    name: str
    material: Material
    length: float  # m
    section: float
    cells: int
    web: float = 0.0

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of the cells in order."""
        return (self.name,) if self.cells == 1 else tuple(f"{self.name}.{k}" for k in range(self.cells))

    @property
    def capacity(self) -> float:
        """J/K of the whole body."""
        return self.material.density * self.material.heat * self.section * self.length

    @property
    def conductance(self) -> float:
        """W/K from end to end."""
        return self.material.conductivity * (self.web or self.section) / self.length

    def span(self, low: float = 0.0, high: float = 1.0) -> list[Share]:
        """The cells between two places along the body (0 to 1) and their shares, which add up to 1.

        >>> Bar("b", STEEL, 1.0, 0.1, 4).span(0.5, 1.0)
        [('b.2', 0.5), ('b.3', 0.5)]
        """
        ends = [k / self.cells for k in range(self.cells + 1)]
        parts = [
            (node, (min(b, high) - max(a, low)) / (high - low))
            for node, a, b in zip(self.nodes, ends, ends[1:], strict=False)
        ]
        return [(node, share) for node, share in parts if share > 1e-12]


def facing(one: list[Share], other: list[Share]) -> list[tuple[str, str, float]]:
    """Pairs of cells that face each other along two stretches, with their shares of the whole contact.

    >>> facing([("a", 1.0)], [("b", 0.25), ("c", 0.75)])
    [('a', 'b', 0.25), ('a', 'c', 0.75)]
    """
    pairs, i, j = [], 0, 0
    left_i, left_j = one[0][1], other[0][1]
    while True:
        share = min(left_i, left_j)
        pairs.append((one[i][0], other[j][0], share))
        left_i, left_j = left_i - share, left_j - share
        if left_i <= 1e-12:
            i += 1
            left_i = one[i][1] if i < len(one) else 0.0
        if left_j <= 1e-12:
            j += 1
            left_j = other[j][1] if j < len(other) else 0.0
        if i == len(one) or j == len(other):
            return pairs
