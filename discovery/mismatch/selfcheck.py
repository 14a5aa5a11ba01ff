"""The self-check: if the answer were true, how often would the same search on new noise name it again?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.evidence import Board
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.search import Search

Array = NDArray[np.float64]

DRAWS = 400


def named_again(found: Search, h: Hypothesis, seed: int = 0) -> float | None:
    """Share of simulated recordings on which an effect stands first again among all that were scored.

    The readings are those of the repaired model with fresh noise, seen on the first board (to first order in
    the effect's size); None for an effect that this board did not hold.
    """
    board = found.board
    amplitudes = [found.best.model.parameters[name] for name in h.amplitudes]
    size = np.array([p.values[h.recording] if h.recording and p.values else p.value for p in amplitudes])
    index = [k for k, owner in enumerate(board.owners) if board.hypotheses[owner].key == h.key]
    if not index:
        return None
    view = int(np.argmax([v.level for v in found.best.views]))
    z = board.projected[view]
    shapes = {name: found.best.model.parameters[name].value for name in h.shapes}
    nearest = min(
        index,
        key=lambda k: sum(
            abs(np.log(max(v, 1e-9) / max(shapes.get(n, v), 1e-9)))
            for n, v in board.hypotheses[board.owners[k]].shapes.items()
        ),
    )
    truth = z[:, nearest] * float(size[0])
    first = _first(board, z, truth, seed)
    return float(np.mean([board.hypotheses[board.owners[k]].key == h.key for k in first]))


def _first(board: Board, z: Array, truth: Array, seed: int) -> list[int]:
    """Amplitude that stands first in each draw, by log Bayes factor of a single amplitude."""
    rng = np.random.default_rng(seed)
    gram = np.einsum("na,na->a", z, z)
    precision = gram + board.spreads**-2
    signs = np.array([board.hypotheses[o].effect.amplitude.sign for o in board.owners])
    noise = z.T @ rng.standard_normal((len(truth), DRAWS))
    dot = (z.T @ truth)[:, None] + noise
    gain = 0.5 * dot**2 / precision[:, None] - 0.5 * np.log(precision * board.spreads**2)[:, None]
    gain[(signs[:, None] * dot) < 0] = -np.inf
    return [int(k) for k in np.argmax(gain, axis=0)]


def false_alarm(board: Board, view_index: int, best: float, seed: int = 1) -> float:
    """Family-wise p-value: share of noise-only recordings whose best score reaches `best` (log Bayes factor).

    The board's instants were chosen on the data, so events make it slightly too small; they carry their own
    cost.
    """
    z = board.projected[view_index]
    rng = np.random.default_rng(seed)
    gram = np.einsum("na,na->a", z, z)
    precision = gram + board.spreads**-2
    signs = np.array([board.hypotheses[o].effect.amplitude.sign for o in board.owners])
    cost = np.array([board.hypotheses[o].cost for o in board.owners])
    dot = z.T @ rng.standard_normal((z.shape[0], 5 * DRAWS))
    gain = (
        0.5 * dot**2 / precision[:, None]
        - 0.5 * np.log(precision * board.spreads**2)[:, None]
        - cost[:, None]
    )
    gain[(signs[:, None] * dot) < 0] = -np.inf
    top = gain.max(axis=0)
    return float((1 + np.sum(top >= best)) / (1 + len(top)))
