"""Which inputs drive the outputs: the fewest whose first-order responses explain them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.recordings import Campaign
from discovery.recordings.responses import responses

Array = NDArray[np.float64]

_SHARES = (0.0, 0.01, 0.03, 0.1, 0.3)  # of the longest recording: time constants
_MOST = 5
_LEAST = 0.02  # of what is left that one more input has to explain
_RIDGE = 1e-4


def strongest(
    campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], inputs: Sequence[str]
) -> list[str]:
    """At most five of the inputs, chosen one after the other by what each adds to those before it.

    Args:
        recordings: to fit; nothing else is looked at.
    """
    moving = [name for name in inputs if _moves(campaign, recordings, name)]
    if len(moving) <= 1:
        return moving
    length = max(float(campaign.recordings[r].time[-1]) for r in recordings)
    blocks, targets = _blocks(campaign, recordings, outputs, moving, [share * length for share in _SHARES])
    chosen: list[str] = []
    left = 1.0
    while len(chosen) < min(_MOST, len(moving)):
        tried = {
            name: _unexplained(blocks, targets, [*chosen, name]) for name in moving if name not in chosen
        }
        best = min(tried, key=lambda name: tried[name])
        if chosen and tried[best] > (1 - _LEAST) * left:
            break
        chosen.append(best)
        left = tried[best]
    return [name for name in inputs if name in chosen]


def _moves(campaign: Campaign, recordings: Sequence[str], name: str) -> bool:
    known = np.concatenate([campaign.recordings[r].values.get(name, np.empty(0)) for r in recordings])
    known = known[np.isfinite(known)]
    return bool(known.size and known.min() < known.max())


def _blocks(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Sequence[str],
    taus: list[float],
) -> tuple[list[dict[str, Array]], list[Array]]:
    """For each output, responses by input and readings, both about their means in each recording."""
    between = {name: campaign.channels[name].between for name in inputs}
    blocks, targets = [], []
    for output in outputs:
        rows: dict[str, list[Array]] = {name: [] for name in inputs}
        read: list[Array] = []
        for name in recordings:
            one = campaign.recordings[name]
            known = np.isfinite(one.values[output])
            if known.sum() < 5:
                continue
            at, y = one.time[known], one.values[output][known]
            read.append(y - y.mean())
            for source in inputs:
                found = responses({source: one.values[source]}, one.time, between, at, taus)
                rows[source].append(found - found.mean(axis=0))
        if read:
            blocks.append({source: _scaled(np.concatenate(part)) for source, part in rows.items()})
            targets.append(np.concatenate(read))
    return blocks, targets


def _scaled(columns: Array) -> Array:
    return np.asarray(columns / (np.sqrt((columns**2).mean(axis=0)) + 1e-30))


def _unexplained(blocks: list[dict[str, Array]], targets: list[Array], names: Sequence[str]) -> float:
    """Return the share of variance that the responses do not explain, as the mean over the outputs."""
    shares = []
    for block, y in zip(blocks, targets, strict=True):
        F = np.column_stack([block[name] for name in names])
        gram = F.T @ F + _RIDGE * len(y) * np.eye(F.shape[1])
        left = y - F @ np.linalg.solve(gram, F.T @ y)
        shares.append(float(np.mean(left**2)) / max(float(np.mean(y**2)), 1e-30))
    return float(np.mean(shares)) if shares else 1.0
