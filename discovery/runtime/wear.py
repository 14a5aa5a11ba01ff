"""Wear: which parameters of a model it can change, and how they change together."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported
from discovery.export.trend import Trend
from discovery.runtime.changes import Change, Table, Wear
from discovery.terms import names

Array = NDArray[np.float64]

# Chosen on seeds set aside for it and confirmed on others, see benchmarks/runtime.md
WIDTHS = (0.05, 0.2)  # relative change of a parameter that ages; both widths count half
SUDDEN = 0.02  # relative change at once of a machine whose wear goes on
RATE = 0.01  # relative change a day of what wears, before it is seen
TURNS = 0.001  # relative change a day by which a rate of wear turns in one day, sqrt(2) of it in two
AGES = ("heat load", "rotation speed", "fluid flow", "cooling power", "coolant temperature")


def ageing(exported: Exported) -> dict[str, frozenset[str]]:
    """Parameters that wear can change, with the inputs that wear them: all their terms depend on a load, a
    speed, a flow or a coolant. What conducts and what the air takes does not wear.
    """
    loads = {i.name for i in exported.inputs if i.role in AGES}
    return {
        name: frozenset[str]().union(*used) & loads
        for name, used in uses(exported).items()
        if used and all(one & loads for one in used)
    }


def uses(exported: Exported) -> dict[str, list[frozenset[str]]]:
    """By fitted parameter, the names in each formula that holds it."""
    model = exported.model
    formulas = [names(e) for e in (*(term.expression for term in model.terms), *model.outputs.values())]
    fitted = exported.document["knowledge"]["parameters"]
    return {name: [frozenset(one) for one in formulas if name in one] for name in fitted}


def wears(exported: Exported, table: Table) -> list[Wear]:
    """Wear of what one load wears, or of all: every parameter by one share, as of one bearing or one pump, or
    each by a share of its own as well.
    """
    loads = list(dict.fromkeys(ageing(exported).values()))
    parts = [*([load] for load in loads), loads] if len(loads) > 1 else [loads]
    found = []
    for part in parts:
        common, own = _roots(exported, part)
        found += [
            _wear_of(exported, table, width * root)
            for width in WIDTHS
            for root in (common, np.hstack([common, own]))
        ]
    return found


def one_load(exported: Exported, table: Table) -> list[tuple[list[str], Change]]:
    """For each group of loads that wear the same parameters, those parameters by one share, at once; the
    change has a size of one.
    """
    loads = dict.fromkeys(ageing(exported).values())
    found = []
    for load in loads:
        wear = _wear_of(exported, table, _roots(exported, [load])[0])
        found.append((sorted(load), Change(wear.before, wear.root)))
    return found


def usual_wear(exported: Exported, table: Table, worn: Sequence[str], days: float) -> Wear | None:
    """Wear that goes on where a machine has worn before: over so many days, of any size where no trend is
    known, else at about its rate.
    """
    loads = {load for name, load in ageing(exported).items() if name in worn}
    if not loads:
        return None
    root, trend = _roots(exported, loads)[0], exported.trend
    if trend is None:
        return _wear_of(exported, table, WIDTHS[0] * root)
    during = days * math.hypot(trend.sd, TURNS * math.sqrt(days))
    return replace(_wear_of(exported, table, SUDDEN * root), share=during / SUDDEN)


def trend_of(
    exported: Exported, change: Mapping[str, tuple[float, float]], days: float, at: float
) -> Trend | None:
    """The trend after recordings of so many days until an instant [s], in which parameters wore by so much
    more than the trend before said, with standard deviations.
    """
    sizes = {n: abs(exported.model.parameters[n].value) for n in change}
    shares = [sd / sizes[n] / days for n, (_, sd) in change.items() if sizes[n] > 0]
    if not shares:
        return None
    before, sd = exported.trend.per_day if exported.trend else {}, math.sqrt(np.mean(np.square(shares)))
    kept = 1.0 if exported.trend else RATE**2 / (RATE**2 + sd**2)
    rates = {n: before.get(n, 0.0) + kept * by / days for n, (by, _) in change.items()}
    return Trend(at, {**before, **rates}, math.sqrt(kept) * sd)


def _roots(exported: Exported, part: Collection[frozenset[str]]) -> tuple[Array, Array]:
    """Changes of the parameters that age, by their sizes: (A, L) those of each load in a part by one share,
    (A, K) each of them by its own.
    """
    loads = ageing(exported)
    size = np.array([abs(exported.model.parameters[name].value) for name in loads])
    common = np.array([load == one for load in loads.values() for one in part], dtype=float)
    common = common.reshape(len(loads), len(part))
    return size[:, None] * common, np.diag(size)[:, common.any(axis=1)]


def _wear_of(exported: Exported, table: Table, root: Array) -> Wear:
    fitted, old = list(uses(exported)), ageing(exported)
    at = [k for k, name in enumerate(fitted) if name in old]
    return Wear(table.at["at once"][at], table.at["bit by bit"][at], root)
