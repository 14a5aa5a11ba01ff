"""An optimiser of PySINDy instead of our search, by name and arguments."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.schema import suggest
from discovery.sparse.choice import Choice, evidence
from discovery.sparse.gram import factor
from discovery.sparse.problem import Problem
from discovery.sparse.search import Search, Terms

Array = NDArray[np.float64]


def borrowed(optimiser: Any, arguments: Mapping[str, Any]) -> Callable[[Problem], Choice]:
    """A choice made by an optimiser of PySINDy: "pysindy:SR3" is `pysindy.SR3(**arguments)`; an object is
    taken as given.

    It gets the M rows that hold all that the readings say (`gram.factor`), columns and target of unit
    length: a coefficient is a share of the output's size, and a threshold of 0.05 drops what makes less
    than 5 % of it, in any unit. Of neighbours on the grid of time constants the strongest is taken, and its
    time constant refined.

    Raises:
        UserError: PySINDy has no such optimiser, or it does not take these arguments.
    """
    made = _made(optimiser, arguments) if isinstance(optimiser, str) else optimiser

    def select(problem: Problem) -> Choice:
        search = problem.search()
        rows, target = factor(search.g)
        length = search.g.length
        theirs = deepcopy(made)
        fit_quietly(theirs, rows / length, target / max(np.sqrt(search.g.square), 1e-300))
        return evidence(problem, _terms(search, np.ravel(theirs.coef_)))

    return select


def _made(optimiser: str, arguments: Mapping[str, Any]) -> Any:
    import pysindy
    from pysindy.optimizers.base import BaseOptimizer

    name = optimiser.removeprefix("pysindy:")
    known = [
        n for n, one in vars(pysindy).items() if isinstance(one, type) and issubclass(one, BaseOptimizer)
    ]
    known.remove("BaseOptimizer")
    if name not in known:
        raise UserError(
            f"optimiser = 'pysindy:{name}': PySINDy has no optimiser {name}; {suggest(name, known)}"
        )
    try:
        return getattr(pysindy, name)(**arguments)
    except (TypeError, ValueError) as error:
        raise UserError(f"optimiser = 'pysindy:{name}': {error}; correct optimiser_arguments") from None


def _terms(search: Search, coefficients: Array) -> Terms:
    """The set of the columns that are not zero, one term for neighbours of a family, with those that stay."""
    family, place = list(search.always), [0.0] * len(search.always)
    for f, (start, count) in enumerate(zip(search.families.start, search.families.count, strict=True)):
        mine = np.abs(coefficients[start : start + count])
        if f in search.always:
            continue
        used = np.flatnonzero(mine > 0)
        for cluster in np.split(used, np.flatnonzero(np.diff(used) > 1) + 1):
            if len(cluster):
                family.append(f)
                place.append(float(cluster[np.argmax(mine[cluster])]))
    return search.refined(np.array(family, int), np.array(place))


def fit_quietly(optimiser: Any, rows: Array, target: Array) -> None:
    """Fit an optimiser of PySINDy without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "sparsity parameter is too big": an empty support is no fault
        optimiser.fit(rows, target[:, None])
