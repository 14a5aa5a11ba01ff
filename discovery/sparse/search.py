"""The search for a sparse set of terms on normal equations: sets of every size, with shared poles if that is
cheaper.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from discovery.sparse import pursuit
from discovery.sparse.gram import RIDGE, Gram

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

_EXCHANGES = 10  # of one member of a set, at most, before the next size
_EDGE = 0.01  # of the grid's spacing
_TRIES = 6  # entries that run into a term of their own family before growth ends


@dataclass(frozen=True)
class Families:
    """How columns belong together: first column and number of columns of each family, bounds of
    coefficients, and families that have as many terms as they may have.
    """

    start: Ints  # (F,)
    count: Ints
    low: Array
    high: Array
    most: Ints | None = None  # terms of each family at most; None: any number
    bank: Ints | None = None  # (F,) which of several kinds of filters a family stands for; None: one kind

    def alike(self, members: Ints) -> bool:
        """Whether terms of these families may share a mass."""
        return self.bank is None or len(set(self.bank[members].tolist())) < 2

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.count.sum())

    def limited(self, most: Mapping[int, int]) -> Families:
        """The same with at most so many terms of some families; 0: the family may not enter."""
        limits = np.full(len(self.start), np.iinfo(int).max) if self.most is None else self.most.copy()
        limits[list(most)] = list(most.values())
        low, high = (np.where(limits == 0, 0.0, bound) for bound in (self.low, self.high))
        return replace(self, low=low, high=high, most=limits)

    def full(self, members: Ints) -> NDArray[np.bool_]:
        """Which columns (M,) belong to a family of which these members are as many as there may be."""
        if self.most is None:
            return np.zeros(self.columns, dtype=bool)
        return np.repeat(np.bincount(members, minlength=len(self.start)) >= self.most, self.count)


def plain(columns: int, low: Array | None = None, high: Array | None = None) -> Families:
    """Columns that stand where they are, each a family of its own."""
    free = np.full(columns, np.inf)
    return Families(
        np.arange(columns),
        np.ones(columns, int),
        -free if low is None else low,
        free if high is None else high,
    )


@dataclass(frozen=True)
class Terms:
    """A set: family and place of each term, which terms share a place, coefficients, what it takes off the
    cost.
    """

    family: Ints  # (n,)
    place: Array
    pole: Ints
    theta: Array
    gain: float

    def __len__(self) -> int:
        return len(self.family)

    @property
    def members(self) -> tuple[int, ...]:
        """Families in use, in order."""
        return tuple(sorted(int(f) for f in self.family))


class Search:
    """Moves between sets on the normal equations of one output."""

    def __init__(self, g: Gram, families: Families, always: Ints) -> None:
        self.g, self.families, self.always = g, families, np.asarray(always, int)
        f = families
        self._problem = (np.ascontiguousarray(g.matrix), np.ascontiguousarray(g.vector), f.start, f.count)

    def refined(self, family: Ints, place: Array, pole: Ints | None = None) -> Terms:
        """The terms at their best places near `place`."""
        pole = np.arange(len(family)) if pole is None else pole
        where = (family, place, pole, self.families.low, self.families.high)
        found, theta, gain = pursuit.refine(*self._problem, *where)
        return Terms(family, found, pole, theta, gain)

    def of(self, family: Ints) -> Terms:
        """The terms of some families without time constants."""
        return self.refined(family, np.zeros(len(family)))

    def grown(self, terms: Terms) -> Terms | None:
        """The set with the term that lowers the cost most, all refined; None if none may enter.

        A new term that runs into one of its own family was that one's other half: its place is barred. Two
        old ones that run into each other once the new one is there were standing in for it: they become
        one.
        """
        f, size = self.families, len(terms)
        barred = np.zeros(f.columns, dtype=bool)
        for _ in range(_TRIES):
            where = (terms.family, terms.place, f.low, f.high, barred | f.full(terms.family))
            family, place = pursuit.entry(*self._problem, *where)
            if family < 0:
                return None
            found = self.refined(np.append(terms.family, family), np.append(terms.place, float(place)))
            pair = together(found)
            if pair is None:
                if len(found) > size:
                    return found
                terms = found
            elif len(found) - 1 in pair:
                barred[f.start[family] + np.arange(max(place - 3, 0), min(place + 4, f.count[family]))] = True
            else:
                terms = self.without(found, max(pair))
        return None

    def ended(self, terms: Terms) -> dict[int, int]:
        """Families of which a time constant ended at the slow end of the grid, where it only adds up its
        input, with the number of their other terms.
        """
        last = self.families.count[terms.family] - 1
        slow = (last > 0) & (terms.place > last - _EDGE)
        return {int(f): int(np.sum(~slow & (terms.family == f))) for f in terms.family[slow]}

    def binding(self, terms: Terms, price: float, effective: Callable[[Terms], float]) -> dict[int, float]:
        """Families whose bound binds, because the readings ask for a coefficient beyond it; and that
        coefficient.

        Args:
            price: of one more term in a criterion. effective: independent readings, by the set.
        """
        f, found = self.families, {}
        for one in np.flatnonzero(np.isfinite(f.low) | np.isfinite(f.high)):
            if f.most is not None and not f.most[one]:
                continue
            low, high = f.low.copy(), f.high.copy()
            low[one], high[one] = -np.inf, np.inf
            free = Search(self.g, replace(f, low=low, high=high), self.always)
            family, place = terms.family, terms.place
            if one not in family:
                barred = np.repeat(np.arange(len(f.start)) != one, f.count)
                entered, at = pursuit.entry(*self._problem, family, place, low, high, barred)
                if entered < 0:
                    continue
                family, place = np.append(family, one), np.append(place, float(at))
            other = free.refined(family, place)
            asked = other.theta[other.family == one]
            beyond = asked[(asked < f.low[one]) | (asked > f.high[one])]
            if not len(beyond):
                continue
            before, after = (max(self.g.square - s.gain, 1e-9 * self.g.square) for s in (terms, other))
            if effective(other) * np.log(before / after) > price:
                found[int(one)] = float(beyond[np.argmax(np.abs(beyond))])
        return found

    def without(self, terms: Terms, k: int) -> Terms:
        """The set without its term k, refined."""
        rest = np.arange(len(terms)) != k
        _, pole = np.unique(terms.pole[rest], return_inverse=True)
        return self.refined(terms.family[rest], terms.place[rest], pole)

    def shrunk(self, terms: Terms) -> Terms:
        """The set without the term of the smallest cost: theta_j^2 / (S^-1)_jj at fixed places.

        A coefficient at a bound of zero costs nothing and goes first.
        """
        n, f, kept = len(terms), self.families, len(self.always)
        work = tuple(np.empty((n, k)) for k in (f.columns, pursuit.POINTS, pursuit.POINTS))
        S = np.empty((n, n))
        where = (terms.family, terms.place, f.low, f.high)
        theta, _ = pursuit.solved(*self._problem, *where, *work, np.empty(n, int), S)  # type: ignore[call-arg]
        scale = np.sqrt(np.diag(S))
        inverse = np.linalg.inv(S / np.outer(scale, scale) + RIDGE * np.eye(n))
        with np.errstate(over="ignore"):  # a column of a model that nearly runs away: no price is too high
            rise = (theta * scale) ** 2 / np.diag(inverse)
        return self.without(terms, kept + int(np.argmin(rise[kept:])))

    def path(self, size: int) -> list[Terms]:
        """Sets of growing size, from `always` alone up to `size` terms.

        The term that takes most off enters, all places are refined, weak members are exchanged; then the
        largest set (all columns, where none has a time constant) shrinks again. The better set of each size
        stays: growth finds first what two others imitate together, shrinking keeps what growth has a proxy
        for.
        """
        terms = self.of(self.always)
        found = {len(terms): terms}
        while len(terms) < size:
            more = self.grown(terms)
            if more is None:
                break
            terms = self._exchanged(more)
            found[len(terms)] = terms
        if (self.families.count == 1).all():
            rest = np.setdiff1d(np.flatnonzero(np.diag(self.g.matrix) > 0), self.always)
            terms = self.of(np.concatenate([self.always, rest]))
        while len(terms) > len(self.always) + 1:
            terms = self.shrunk(terms)
            known = found.get(len(terms))
            better = known is None or terms.gain > known.gain
            if better and len(terms) <= size and together(terms) is None:
                found[len(terms)] = terms
        return [found[n] for n in sorted(found)]

    def _exchanged(self, terms: Terms) -> Terms:
        for _ in range(_EXCHANGES):
            if len(terms) <= len(self.always) + 1:
                break
            other = self.grown(self.shrunk(terms))
            if other is None or other.gain <= terms.gain * (1 + 1e-9):
                break
            terms = other
        return terms

    def shared(self, terms: Terms, worth: Callable[[Terms], float]) -> Terms:
        """The set with places shared by terms that do as well at one: `worth` falls as long as pairs are
        joined.
        """
        curved = self.families.count[terms.family] >= pursuit.POINTS
        while True:
            poles = sorted({int(q) for q in terms.pole[curved]})
            tried = []
            for a, b in combinations(poles, 2):
                pole = np.where(terms.pole == b, a, terms.pole)
                mine = (pole == a) & curved
                if len(set(terms.family[mine])) < mine.sum() or not self.families.alike(terms.family[mine]):
                    continue  # two terms of one family are two masses
                _, pole = np.unique(pole, return_inverse=True)
                place = np.where(mine, terms.place[mine].mean(), terms.place)
                tried.append(self.refined(terms.family, place, pole))
            best = min(tried, key=worth, default=terms)
            if not worth(best) < worth(terms):
                return terms
            terms = best


def on_grid(terms: Terms, families: Families) -> Array:
    """The coefficients (M,) that the terms are on the columns of the grid."""
    theta = np.zeros(families.columns)
    w, slopes = np.empty(pursuit.POINTS), np.empty(pursuit.POINTS)
    for f, p, value in zip(terms.family, terms.place, terms.theta, strict=True):
        count = families.count[f]
        first = families.start[f] + pursuit.weights(p, count, w, slopes)
        points = pursuit.POINTS if count >= pursuit.POINTS else 1
        theta[first : first + points] += value * w[:points]
    return theta


def together(terms: Terms) -> tuple[int, int] | None:
    """Two terms of one family that have run into each other."""
    for k, j in combinations(range(len(terms)), 2):
        if terms.family[k] == terms.family[j] and abs(terms.place[k] - terms.place[j]) < pursuit.APART:
            return k, j
    return None
