"""Where a search in rates begins: start values from the weak form, then short fits of free runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from discovery.errors import RunsAwayError
from discovery.fitting import Fit
from discovery.models import Model
from discovery.models.model import TIME_UNITS
from discovery.sparse.gram import Gram, total
from discovery.sparse.ratedata import RateData, in_pieces, rough_noise
from discovery.sparse.rates import refit, with_candidates, without
from discovery.sparse.search import Search, Terms, plain
from discovery.sparse.structures import Structure, started
from discovery.sparse.weak import half_widths, weak_rows

FIRST = 12  # rounds of a fit from one of several starts
_SHORTER = 0.5  # of what it misses of whole recordings: then a law holds better over short pieces
_HORIZONS = (4.0, 16.0)  # lengths of free runs, in time scales of the readings


@dataclass(frozen=True)
class Begun:
    """A structure with start values, the candidates that are in it from the start, those whose bound
    binds with the coefficients that the readings ask for, and the cost of a short fit.
    """

    structure: Structure
    entered: set[int]
    binding: Mapping[int, float] = field(default_factory=dict)
    cost: float = np.inf
    weak: Structure | None = None  # with the start values of the weak form


def begin(data: RateData, bare: Structure, nearest: float) -> Begun:
    """Where the search begins: of several widths of the weak form the first from which a short fit of free
    runs comes near, else the one from which it comes nearest. Where none comes near, shorter runs are tried.

    Args:
        nearest: cost of a short fit of another form.
    """
    noise = rough_noise(data).white
    grids = [data.grids[r] for r in data.recordings]
    near = 0.5 * sum(int(grid.measured.sum()) for grid in grids)  # cost of a fit that is off by this noise
    widths = [half_widths(grids, y, s, bare.order) for y, s in zip(data.outputs, noise, strict=True)]
    begun: list[Begun] = []
    for k in range(max(map(len, widths))):
        one = _weakly(data, bare, [some[min(k, len(some) - 1)] for some in widths])
        least = min((other.cost for other in begun), default=np.inf)
        with suppress(RunsAwayError):
            one = _briefly(data, one, model_of(one.structure, one.entered), least)
        if one.cost <= near:
            return one
        begun.append(one)
    if nearest > near:
        for one in tuple(begun):
            least = min(other.cost for other in begun)
            with suppress(RunsAwayError):
                begun.append(_briefly(data, one, _lengthened(data, one), least))
                if begun[-1].cost <= near:
                    break
    return min(begun, key=lambda one: one.cost)


def _briefly(data: RateData, begun: Begun, model: Model, least: float) -> Begun:
    """A start with the values and the cost of a short fit, which begins at those of the model."""
    fit = fit_briefly(data, model, FIRST, least)
    _, labels = with_candidates(begun.structure.model, begun.structure.candidates)
    values = {i: fit.model.parameters[n].value for i, n in enumerate(labels) if i in begun.entered}
    return replace(begun, structure=started(begun.structure, values), cost=fit.cost, weak=begun.structure)


def _lengthened(data: RateData, begun: Begun) -> Model:
    """A start fitted to longer and longer free runs, from a few time scales of the readings on.

    Raises:
        RunsAwayError: it misses short pieces by as much as whole recordings, so their length is not why.
    """
    model = model_of(begun.weak or begun.structure, begun.entered)
    count = sum(int(grid.measured.sum()) for grid in data.grids.values())
    for scales in _HORIZONS:
        pieces = in_pieces(data, scales * data.scale)
        fit = fit_briefly(pieces, model, FIRST)
        read = sum(int(grid.measured.sum()) for grid in pieces.grids.values())
        if fit.cost / read > _SHORTER * begun.cost / count:
            raise RunsAwayError(f"'{model.name}' misses short pieces as well")
        model = fit.model
    return model


def _weakly(data: RateData, structure: Structure, widths: Sequence[float]) -> Begun:
    """Start values of the candidates, the set to begin with, and candidates whose bound binds with what the
    readings ask for, by the weak form of the readings with windows of a half width [s] for each output.
    """
    second = TIME_UNITS[structure.model.time_unit]
    values: dict[int, float] = {}
    chosen: set[int] = set()
    binding: dict[int, float] = {}
    for k, output in enumerate(data.outputs):
        into = structure.rates.get(output, output)
        mine = [i for i, c in enumerate(structure.candidates) if c.into == into]
        library = [structure.candidates[i].expression for i in mine]
        grids = [data.grids[r] for r in data.recordings]
        rows = [
            weak_rows(g, output, library, None, None, structure.order, widths[k], structure.rates, second)
            for g in grids
        ]
        g = total([one.gram for one in rows])
        low, high = (
            np.array([getattr(structure.candidates[i], side) for i in mine]) for side in ("low", "high")
        )
        search = Search(g, plain(len(mine), low, high), np.array([], int))
        path = search.path(min(len(mine), 12))
        independent = sum(float(one.time[-1] - one.time[0]) / one.half + 1 for one in rows)
        best = min(path, key=lambda one: _criterion(g, independent, one.gain, len(one), len(mine)))
        values |= {mine[f]: float(v) for f, v in zip(best.family, best.theta, strict=True)}
        chosen |= {mine[f] for f in best.members}
        price = _price(independent, len(mine))
        binding |= {mine[f]: asked for f, asked in search.binding(best, price, _always(independent)).items()}
    return Begun(started(structure, values), chosen, binding)


def _criterion(g: Gram, effective: float, gain: float, size: int, library: int) -> float:
    """Extended BIC at the number of independent windows."""
    left = max(g.square - gain, 1e-9 * g.square)
    return float(effective * np.log(left / g.count) + size * _price(effective, library))


def _always(count: float) -> Callable[[Terms], float]:
    return lambda _: count


def _price(effective: float, library: int) -> float:
    """What the criterion asks of one more term."""
    return float(np.log(effective) + 2 * np.log(library))


def model_of(structure: Structure, entered: Collection[int]) -> Model:
    """The model of a structure with some of its candidates."""
    model, labels = with_candidates(structure.model, structure.candidates)
    return without(model, [name for i, name in enumerate(labels) if i not in entered])


def fit_briefly(data: RateData, model: Model, rounds: int, goal: float = np.inf) -> Fit:
    """A fit under the rough noise, from the values of the model."""
    noise, recordings = rough_noise(data), data.recordings
    return refit(model, data.campaign, recordings, data.outputs, {}, data.grids, noise, rounds, goal)
