"""A sparse regression of one output on several trajectories, everything divided by its noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.sparse.folds import Blocks, Ints, make_folds
from discovery.sparse.gram import Gram, gram, project_out, total
from discovery.sparse.pursuit import POINTS
from discovery.sparse.search import Families, Search, Terms, on_grid

Array = NDArray[np.float64]

WHOLE = 4  # trajectories from which whole ones are left out; of fewer a quarter of each


@dataclass(frozen=True)
class Problem:
    """readings = columns theta + nuisance delta + noise, by trajectory; delta has a normal prior.

    The nuisance is what is left of unknown start values. It is of one trajectory each, and is taken out of
    the normal equations of every trajectory before anything is searched.
    """

    columns: tuple[Array, ...]  # (R, M) each
    nuisance: tuple[Array, ...]  # (R, m) each
    precision: tuple[Array, ...]  # (m,) each: inverse variances of delta, over the noise
    readings: tuple[Array, ...]  # (R,) each, NaN: not read
    blocks: Blocks
    families: Families
    always: Ints  # families that are in every set
    max_terms: int  # with those of `always`
    start_sd: float = 1.0  # spread of a start value over the noise
    tolerance: float = 1.0  # standard errors by which a sparser set may be worse on what was left out
    bootstraps: int = 0
    seed: int = 0
    zeroed: bool = False  # the last nuisance is a zero of each trajectory
    zero_sd: float = 1.0  # its spread
    parts: float = 0.0  # precision of the part that a family has in the readings, of what it moves there

    @cached_property
    def grams(self) -> tuple[dict[int, Gram], ...]:
        """Normal equations by trajectory and block, columns [library, nuisance]."""
        found = []
        for x, d, y, block in zip(self.columns, self.nuisance, self.readings, self.blocks.of, strict=True):
            rows, known = np.column_stack([x, d]), np.isfinite(y)
            mine = {int(b): known & (block == b) for b in np.unique(block)}
            found.append({b: gram(rows[one], y[one]) for b, one in mine.items()})
        return tuple(found)

    def changed(self, **changes: Any) -> Problem:
        """The problem with other beliefs of the same readings and columns: normal equations stay."""
        other = replace(self, **changes)
        if "grams" in self.__dict__:
            other.__dict__["grams"] = self.grams
        return other

    def pooled(self, weights: Array | None = None) -> Gram:
        """Normal equations of the library, the nuisance taken out; `weights` (B,) says how often a block
        counts.
        """
        weights = np.ones(self.blocks.count) if weights is None else weights
        parts = []
        for blocks, precision in zip(self.grams, self.precision, strict=True):
            used = [b for b in blocks if weights[b] > 0]
            if used:
                whole = total([blocks[b] for b in used], [weights[b] for b in used])
                starts = np.arange(self.families.columns, len(whole.vector))
                parts.append(project_out(whole, starts, precision) if len(starts) else whole)
        return total(parts)

    def search(self, weights: Array | None = None) -> Search:
        """Moves between sets on the pooled normal equations."""
        return Search(self._believed(self.pooled(weights)), self.families, self.always)

    def _believed(self, g: Gram) -> Gram:
        """Normal equations with the prior of the parts: rho |X_f theta_f|^2 of each family f, what is always
        in the set (the offset) taken out of X_f.
        """
        if not self.parts:
            return g
        matrix = g.matrix.copy()
        for mine, moved in self._moved(g):
            matrix[mine, mine] += self.parts * moved
        return replace(g, matrix=matrix)

    def _moved(self, g: Gram) -> Iterator[tuple[slice, Array]]:
        """Columns of each family, and their normal equations without what is always in the set."""
        fixed = self.families.start[self.always]
        inverse = np.linalg.pinv(g.matrix[np.ix_(fixed, fixed)])
        for first, count in zip(self.families.start, self.families.count, strict=True):
            mine = slice(first, first + count)
            across = g.matrix[mine, fixed]
            yield mine, g.matrix[mine, mine] - across @ inverse @ across.T

    def spreads(self, terms: Terms) -> Array:
        """Standard deviation (k,) of the coefficient of each term in the prior of the parts."""
        moved = [some for _, some in self._moved(self.pooled())]
        found = np.full(len(terms), np.inf)
        for k, f in enumerate(terms.family):
            if f in self.always or not self.parts:
                continue
            alone = replace(
                terms, family=terms.family[k : k + 1], place=terms.place[k : k + 1], theta=np.ones(1)
            )
            first = self.families.start[f]
            column = on_grid(alone, self.families)[first : first + self.families.count[f]]
            found[k] = (self.parts * max(column @ moved[f] @ column, 1e-300)) ** -0.5
        return found

    def folds(self) -> list[tuple[Ints, Search]]:
        """What is left out in each fold, and the search on the rest."""
        found = []
        for fold in make_folds(self.blocks, len(self.columns) >= WHOLE):
            weights = np.ones(self.blocks.count)
            weights[fold] = 0.0
            found.append((fold, self.search(weights)))
        return found

    def curved(self, terms: Terms) -> NDArray[np.bool_]:
        """Which terms have a time constant."""
        return np.asarray(self.families.count[terms.family] >= POINTS)

    def numbers(self, terms: Terms) -> int:
        """Numbers that a set holds: coefficients and time constants."""
        return len(terms) + len(set(terms.pole[self.curved(terms)].tolist()))

    def residuals(self, theta: Array) -> list[Array]:
        """Residuals of the readings of each trajectory with coefficients (M,) and the nuisance."""
        left = []
        for x, d, y, precision in zip(
            self.columns, self.nuisance, self.readings, self.precision, strict=True
        ):
            known = np.isfinite(y)
            rest, decays = (y - x @ theta)[known], d[known]
            if decays.size:
                rest = rest - decays @ np.linalg.solve(
                    decays.T @ decays + np.diag(precision), decays.T @ rest
                )
            left.append(rest)
        return left


def equal_shares(start_sd: float, counts: Sequence[int], zero_sd: float | None = None) -> tuple[Array, ...]:
    """Precisions of nuisances (m,) that share the variance of a start value equally.

    Args:
        zero_sd: the last one is the zero of the trajectory, with this spread of its own.
    """
    if zero_sd is None:
        return tuple(np.full(m, m / start_sd**2) for m in counts)
    return tuple(np.r_[np.full(m - 1, (m - 1) / start_sd**2), 1 / zero_sd**2] for m in counts)
