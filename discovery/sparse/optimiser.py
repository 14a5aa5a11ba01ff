"""The constrained search as an optimiser of `pysindy.SINDy`: signs, bounds, terms that stay, time constants
that move.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pysindy.optimizers.base import BaseOptimizer

from discovery.fitting.noise import roughness
from discovery.sparse.choice import Choice, chosen
from discovery.sparse.folds import PREDICT, make_blocks
from discovery.sparse.library import Feature, FilteredInputs, ModelTerms
from discovery.sparse.problem import Problem, equal_shares
from discovery.sparse.search import Families, Terms, plain

Array = NDArray[np.float64]
Bounds = Mapping[str, tuple[float, float]]


class SparseSearch(BaseOptimizer):  # type: ignore[misc]
    """PySINDy optimiser: orthogonal matching pursuit on normal equations.

    Minimises |y - x c|^2 for each number of non-zero coefficients c, term by term (Pati, Rezaiifar &
    Krishnaprasad, Asilomar 1993). Data left out choose the number of terms: the smallest model within
    `tolerance` standard errors of the best one.

    With a `FilteredInputs` library the search moves the time constants, and after `fit` the library holds
    only the chosen features. With any other library the columns do not change.

    Args:
        library: the library of the same `SINDy`, if it is one of this package; None: plain columns.
        max_terms: largest number of terms of one target, without those of `keep`.
        bounds: smallest and largest coefficient by drive (without a library: by number of the column); (0,
            inf) fixes the sign.
        keep: drives (columns) that are in every set.
        noise: standard deviation of a reading of each target, in its unit; default estimated from the
            readings.
        tolerance: a sparser set may be worse on left-out data by so many standard errors.
        blocks: number of pieces of the trajectories for these standard errors.
        bootstraps, seed: number and seed of block bootstraps for the stability of the terms.
        select: makes the `Choice` of a `Problem`; default by free runs on left-out data.

    Attributes:
        coef_: (targets, columns) coefficients.
        choices_: for each target, the path of the search and the chosen terms.
    """

    def __init__(
        self,
        library: FilteredInputs | ModelTerms | None = None,
        max_terms: int = 12,
        bounds: Bounds | None = None,
        keep: Sequence[str] = (),
        noise: Sequence[float | None] | None = None,
        tolerance: float = PREDICT,
        blocks: int = 24,
        bootstraps: int = 0,
        seed: int = 0,
        select: Callable[[Problem], Choice] = chosen,
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
        self.select = select

    def fit(self, x_: Any, y: Any, sample_weight: Any = None, **_: Any) -> Self:
        """Choose and fit terms for each target.

        Args:
            x_: (N, M) columns of all trajectories, one below the other.
            y: (N,) or (N, targets) readings; NaN means no reading.

        Raises:
            ValueError: sample weights, or a bound or kept term that the library does not have.
        """
        if sample_weight is not None:
            raise ValueError("SparseSearch has no sample_weight; repeat rows or leave them out")
        x, targets = np.asarray(x_, dtype=float), np.asarray(y, dtype=float)
        targets = targets.reshape(len(x), -1)
        self.choices_ = [self._choose(x, target, k) for k, target in enumerate(targets.T)]
        self._place(x.shape[1])
        self.intercept_ = 0.0
        return self

    def _reduce(self, x: Any, y: Any) -> None:
        """Required by BaseOptimizer; `fit` works on normal equations instead."""

    def _choose(self, x: Array, target: Array, k: int) -> Choice:
        """The choice for one target, in its unit."""
        problem, noise = self._problem(x, target, k)
        found = self.select(problem)
        return replace(
            found,
            terms=replace(found.terms, theta=found.terms.theta * noise),
            left_out=tuple(noise * rms for rms in found.left_out),
            fit=tuple(noise * rms for rms in found.fit),
            start_sd=found.start_sd * noise,
            zero_sd=found.zero_sd * noise,
            spreads=tuple(noise * one for one in found.spreads),
        )

    def _problem(self, x: Array, target: Array, k: int) -> tuple[Problem, float]:
        """The problem of one target over its noise, and the noise."""
        library = self.library
        if library is not None and sum(getattr(library, "rows_", ())) != len(x):
            raise ValueError(
                "SparseSearch(library) needs the object that is the feature_library of the same SINDy"
            )
        rows = [len(x)] if library is None else library.rows_
        times = [np.arange(len(x), dtype=float)] if library is None else library.times_
        nuisance = [np.zeros((len(x), 0))] if library is None else library.nuisance_
        cuts = np.cumsum(rows)[:-1]
        readings = tuple(np.split(target, cuts))
        size = float(np.nanstd(target)) or 1.0
        noise = (self.noise[k] if self.noise else None) or roughness(readings) or 1e-3 * size
        counts = [d.shape[1] for d in nuisance]
        zeroed = isinstance(library, FilteredInputs) and library.zeroed
        precision = (
            tuple(library.precision_)
            if isinstance(library, ModelTerms)
            else equal_shares(size / noise, counts, size / noise if zeroed else None)
        )
        kept = [int(self._mine(name)[-1]) for name in self._always]
        problem = Problem(
            tuple(np.split(x, cuts)),
            tuple(nuisance),
            precision,
            tuple(y / noise for y in readings),
            make_blocks(times, self.blocks),
            self._families(x.shape[1], noise),
            np.array(kept, int),
            self.max_terms + len(kept),
            size / noise,
            self.tolerance,
            self.bootstraps,
            self.seed,
            zeroed,
            size / noise,
        )
        return problem, float(noise)

    @property
    def _always(self) -> list[str]:
        """Names of what is in every set, the offset first."""
        offset = ["1"] if isinstance(self.library, FilteredInputs) and self.library.offset else []
        return list(dict.fromkeys([*offset, *self.keep]))

    def _families(self, columns: int, noise: float) -> Families:
        families = self.library.families_ if isinstance(self.library, FilteredInputs) else plain(columns)
        low, high = families.low.copy(), families.high.copy()
        for name, (least, most) in (self.bounds or {}).items():
            mine = self._mine(name)
            low[mine], high[mine] = least / noise, most / noise
        return replace(families, low=low, high=high)

    def _mine(self, name: str) -> list[int]:
        """Families of a drive or column. Raises ValueError: there is none."""
        if self.library is None:
            if not name.isdecimal():
                raise ValueError(f"'{name}': without library=, name columns by number, as in keep=['0']")
            return [int(name)]
        names = self.library.drive_of_family_
        found = [f for f, drive in enumerate(names) if drive == name]
        if not found:
            raise ValueError(f"the library has no '{name}' ({', '.join(dict.fromkeys(names))})")
        return found

    def _place(self, columns: int) -> None:
        """Coefficients (targets, features); a library that can move holds the chosen features from now on."""
        sets = [choice.terms for choice in self.choices_]
        if isinstance(self.library, FilteredInputs):
            found = [features_of(self.library, terms) for terms in sets]
            features = list(dict.fromkeys(f for one in found for f in one))
            self.library.keep(features)
            places = [[features.index(f) for f in one] for one in found]
            columns = len(features)
        else:
            places = [terms.family.tolist() for terms in sets]
        self.coef_ = np.zeros((len(sets), columns))
        for row, mine, terms in zip(self.coef_, places, sets, strict=True):
            row[mine] = terms.theta
        self.ind_ = self.coef_ != 0


def features_of(library: FilteredInputs, terms: Terms) -> list[Feature]:
    """The features of a set, in its order."""
    return [library.feature_at(int(f), float(p)) for f, p in zip(terms.family, terms.place, strict=True)]
