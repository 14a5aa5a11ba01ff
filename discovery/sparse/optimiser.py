"""The constrained search as an optimiser of `pysindy.SINDy`: signs, bounds, terms that stay, time constants that
move; and any optimiser of PySINDy on the same columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pysindy.optimizers.base import BaseOptimizer

from discovery.sparse.choice import Choice, Problem, chosen
from discovery.sparse.folds import PREDICT, make_blocks
from discovery.sparse.library import Feature, FilteredInputs
from discovery.sparse.search import Families, Terms, plain

Array = NDArray[np.float64]
Bounds = Mapping[str, tuple[float, float]]


class SparseSearch(BaseOptimizer):
    """Orthogonal matching pursuit on normal equations, its size chosen by what is left out.

    With a `FilteredInputs` library the time constants move continuously, and after `fit` the library holds the
    chosen features alone. With any other library the columns stay where they are.

    Args:
        library: the library of the same `SINDy`, whose time constants may move; None: columns as they are.
        max_terms: most terms of one target.
        bounds: smallest and largest coefficient by drive (by column number without a library); (0, inf) is a sign.
        keep: drives (columns) that are in every set.
        noise: standard deviation of a reading of each target; default estimated.
        tolerance: standard errors by which a sparser set may be worse on what was left out.
        blocks: pieces that the trajectories are cut into for the standard errors.
        bootstraps, seed: block bootstraps for the stability of the terms.
    """

    def __init__(
        self,
        library: FilteredInputs | None = None,
        max_terms: int = 12,
        bounds: Bounds | None = None,
        keep: Sequence[str] = (),
        noise: Sequence[float | None] | None = None,
        tolerance: float = PREDICT,
        blocks: int = 24,
        bootstraps: int = 0,
        seed: int = 0,
    ) -> None:
        super().__init__()
        self.library = library
        self.max_terms = max_terms
        self.bounds = bounds
        self.keep = keep
        self.noise = noise
        self.tolerance = tolerance
        self.blocks = blocks
        self.bootstraps = bootstraps
        self.seed = seed

    def fit(self, x_: Any, y: Any, sample_weight: Any = None, **_: Any) -> Self:
        """Choose and fit terms for each target.

        Args:
            x_: (N, M) columns of all trajectories, one below the other.
            y: (N,) or (N, targets) readings, NaN where there are none.

        Raises:
            ValueError: weights of samples, a bound or a kept term that the library does not have.
        """
        if sample_weight is not None:
            raise ValueError("SparseSearch takes no sample_weight; repeat rows or leave them out")
        x, targets = np.asarray(x_, dtype=float), np.asarray(y, dtype=float)
        targets = targets.reshape(len(x), -1)
        self.choices_ = [self._choose(x, target, k) for k, target in enumerate(targets.T)]
        self._place(x.shape[1])
        self.intercept_ = 0.0
        return self

    def _reduce(self, x: Any, y: Any) -> None:
        """BaseOptimizer asks for it; `fit` does the work on normal equations."""

    def _choose(self, x: Array, target: Array, k: int) -> Choice:
        problem, noise = self._problem(x, target, k)
        found = chosen(problem, self.bootstraps, self.seed)
        terms = replace(found.terms, theta=found.terms.theta * noise)
        return replace(found, terms=terms, left_out=found.left_out * noise**2, fit=found.fit * noise**2, start_sd=found.start_sd*noise)

    def _problem(self, x: Array, target: Array, k: int) -> tuple[Problem, float]:
        """The problem of one target over its noise, and the noise."""
        library = self.library
        rows = library.rows_ if library else [len(x)]
        cuts = np.cumsum(rows)[:-1]
        readings = tuple(np.split(target, cuts))
        size = float(np.sqrt(np.nanmean(target**2))) or 1.0
        noise = (self.noise[k] if self.noise else None) or rough_noise(readings) or 1e-3 * size
        times = library.times_ if library else [np.arange(len(x), dtype=float)]
        families = self._families(x.shape[1], noise)
        problem = Problem(
            tuple(np.split(x, cuts)),
            tuple(library.decays_ if library else [np.zeros((len(x), 0))]),
            tuple(y / noise for y in readings),
            make_blocks(times, self.blocks),
            families,
            np.array([self._family(name) for name in self._always], int),
            size / noise,
            self.max_terms + len(self._always),
            self.tolerance,
        )
        return problem, noise

    @property
    def _always(self) -> list[str]:
        offset = ["1"] if self.library and self.library.offset else []
        return [*offset, *(name for name in self.keep if name != "1")]

    def _families(self, columns: int, noise: float) -> Families:
        families = self.library.families_ if self.library else plain(columns)
        low, high = families.low.copy(), families.high.copy()
        for name, (least, most) in (self.bounds or {}).items():
            mine = self._mine(name)
            low[mine], high[mine] = least / noise, most / noise
        return replace(families, low=low, high=high)

    def _mine(self, name: str) -> list[int]:
        """Families of a drive. Raises ValueError: there is none."""
        if self.library is None:
            return [int(name)]
        found = [f for f, drive in enumerate(self.library.drive_of_family_) if drive == name]
        if not found:
            known = ", ".join(dict.fromkeys(self.library.drive_of_family_))
            raise ValueError(f"'{name}' is no drive of the library ({known})")
        return found

    def _family(self, name: str) -> int:
        """The family that stays for a drive: through a lag where there is one."""
        return self._mine(name)[-1]

    def _place(self, columns: int) -> None:
        """Coefficients (targets, features); a library that can move holds the chosen features from now on."""
        sets = [choice.terms for choice in self.choices_]
        if self.library is None:
            self.coef_ = np.zeros((len(sets), columns))
            for row, terms in zip(self.coef_, sets, strict=True):
                row[terms.family] = terms.theta
        else:
            found = [features_of(self.library, terms) for terms in sets]
            features = list(dict.fromkeys(f for one in found for f in one))
            self.coef_ = np.zeros((len(sets), len(features)))
            for row, mine, terms in zip(self.coef_, found, sets, strict=True):
                row[[features.index(f) for f in mine]] = terms.theta
            self.library.keep(features)
        self.ind_ = self.coef_ != 0


def features_of(library: FilteredInputs, terms: Terms) -> list[Feature]:
    """The features that a set stands for, in its order."""
    return [library.feature_at(int(f), float(p)) for f, p in zip(terms.family, terms.place, strict=True)]


def rough_noise(readings: Sequence[Array]) -> float:
    """Standard deviation of white noise, by second differences of consecutive readings and their median.

    Of x[k-1] - 2 x[k] + x[k+1] white noise makes sqrt(6) times its own; what moves slowly makes nothing.
    """
    second = [np.diff(y[np.isfinite(y)], 2) for y in readings]
    size = np.abs(np.concatenate(second))
    return float(np.median(size) / 0.6745 / np.sqrt(6)) if len(size) else 0.0
