"""How large a change may be that recordings would not have shown: what the verdict `nothing` stands for."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from discovery.evidence.bayes import Score
from discovery.export.document import Exported
from discovery.printed import printed, sized
from discovery.runtime.changes import Change, Seen, Table
from discovery.runtime.verdict import LEAST_ODDS, SURE, Explanation, before
from discovery.runtime.wear import one_load

ALMOST = 1.645  # standard deviations: of 20 changes of this size, 19 would have been seen


def unseen(
    exported: Exported,
    table: Table,
    seen: Seen,
    offered: Mapping[Explanation, list[Change]],
    physics: Mapping[str, Score],
    share: float,
) -> dict[str, str]:
    """The largest change that recordings may hide, with its unit: of what one load wears, of all exchange
    with a temperature, of the sensor of an input, and of the effects nearest to being seen.

    The model at work is as uncertain as its fit left it; where its laws are coarser than the machine, form
    errors hide more than noise does.

    Args:
        share: of all exchange, by which the first change of each "exchange with" is.
    """
    found = {}
    for loads, change in one_load(exported, table):
        found[f"wear with {' and '.join(loads)}"] = _percent(limit(seen, change, LEAST_ODDS))
    for one, alike in offered.items():
        known = before(one, [*offered])
        if one.kind == "exchange with":
            found[str(one)] = _percent(share * limit(seen, alike[0], SURE - known))
        elif one.kind == "sensor of":
            change = Change(alike[-1].columns, np.ones((1, 1)))
            found[str(one)] = f"{printed(limit(seen, change, max(SURE, LEAST_ODDS - known)))} K"
    for name, claim in physics.items():
        h = claim.hypothesis
        if len(claim.size) != 1 or not claim.t or h.effect.amplitude.fixed is not None:
            continue
        spread = abs(claim.size[0] / claim.t)
        rare = max(0.5 * claim.t**2 - claim.gain, 0.0)  # what the width of the prior costs
        least = math.sqrt(2.0 * (SURE - h.log_odds + rare)) + ALMOST
        found[name] = sized(least * spread, h.units.get(h.amplitudes[0], "1"))
    return {name: size for name, size in found.items() if size}


def limit(seen: Seen, change: Change, least: float) -> float:
    """The size of a change, in units of its root, that would have shown itself almost surely by log odds of
    at least so much; infinite where the readings say nothing of it.
    """
    at = 1 + change.columns
    known = (change.root.T @ seen.gram[np.ix_(at, at)] @ change.root).item()
    if known <= 0.0:
        return math.inf
    size = (math.sqrt(2.0 * least) + ALMOST) / math.sqrt(known)
    for _ in range(3):  # the wider the prior, the more it costs
        size = (math.sqrt(2.0 * least + math.log1p(known * size**2)) + ALMOST) / math.sqrt(known)
    return size


def _percent(share: float) -> str:
    return f"{printed(100.0 * share)} %" if math.isfinite(share) else ""
