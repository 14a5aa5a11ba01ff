"""Start values of candidate terms, from the weak form of the recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from discovery.sparse.gram import solve, total
from discovery.sparse.ratedata import RateData
from discovery.sparse.rates import Candidate
from discovery.sparse.weak import weak_rows


def started(
    found: Sequence[Candidate],
    data: RateData,
    channel: Mapping[str, str],
    constants: Mapping[str, float] | None = None,
) -> list[Candidate]:
    """Candidates with start values from the weak form; `channel` says which readings show each state.

    Hidden masses keep their start values: the weak form sees only what is measured.
    """
    placed: dict[Candidate, float] = {}
    for state, output in channel.items():
        mine = [c for c in found if c.into == state and "_mass" not in c.label]
        rows = [
            weak_rows(
                data.grids[r], output, [c.expression for c in mine], constants, aliases=channel, second=3600.0
            )
            for r in data.recordings
        ]
        low, high = (np.array([getattr(c, side) for c in mine]) for side in ("low", "high"))
        theta = solve(total([one.gram for one in rows]), range(len(mine)), low, high)
        placed |= {c: float(np.clip(value, c.low, c.high)) for c, value in zip(mine, theta, strict=True)}
    return [replace(c, start=placed.get(c, c.start)) for c in found]
