"""Evidence: how much more likely an effect makes the readings, all unknowns integrated out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.lens import Lens, View, log_mean_exp
from discovery.mismatch.signatures import signatures

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """What the linear look says of a hypothesis.

    `gain` is the log Bayes factor against the fit without it (integrated over noise settings), `t` the signed
    score in standard deviations at the best setting, `size` its amplitudes there, `share` what a refit leaves
    of the signature.
    `decidable`: an effect of plausible size would stand out by three standard deviations.
    """

    hypothesis: Hypothesis
    gain: float
    t: float
    size: tuple[float, ...]
    share: float
    decidable: bool


@dataclass(frozen=True)
class Board:
    """Signatures of all hypotheses under all noise settings, ready for single and joint scores."""

    hypotheses: tuple[Hypothesis, ...]
    spreads: Array  # (A,) prior standard deviation of each amplitude
    views: tuple[View, ...]
    projected: tuple[Array, ...]  # per view (N, A)
    lengths: tuple[Array, ...]  # per view (A,), before projection
    owners: NDArray[np.intp]  # (A,) hypothesis of each amplitude

    @property
    def levels(self) -> Array:
        """Log-likelihood of the fit without any hypothesis, by view."""
        return np.array([view.level for view in self.views])


def make_board(lens: Lens, views: Sequence[View], hypotheses: Sequence[Hypothesis], spreads: Array) -> Board:
    """Signatures of hypotheses, whitened and projected under each view."""
    columns = [signatures(t, hypotheses) for t in lens.fit.trajectories]
    projected, lengths = [], []
    for view in views:
        white, _ = lens.whiten(view.noise, columns)
        lengths.append(np.linalg.norm(white, axis=0))
        projected.append(view.project(white))
    owners = np.array([i for i, h in enumerate(hypotheses) for _ in h.amplitudes], dtype=np.intp)
    return Board(tuple(hypotheses), spreads, tuple(views), tuple(projected), tuple(lengths), owners)


def scores(board: Board) -> list[Score]:
    """Score of every hypothesis of a board."""
    out = []
    base = board.levels
    total = float(log_mean_exp(base))
    per_view = [_moments(board, v) for v in range(len(board.views))]
    best_view = int(np.argmax(base))
    for i, h in enumerate(board.hypotheses):
        mine = np.flatnonzero(board.owners == i)
        factors = np.array(
            [_log_bayes(h, mine, *per_view[v], board.spreads) for v in range(len(board.views))]
        )
        gain = float(log_mean_exp(base + factors)) - total
        v = int(np.argmax(base + factors)) if np.isfinite(factors).any() else best_view
        dot, gram_diagonal, z = per_view[v]
        if len(mine) == 1:
            k = mine[0]
            t = float(dot[k] / np.sqrt(max(float(gram_diagonal[k]), 1e-300)))
            precision = float(gram_diagonal[k] + board.spreads[k] ** -2)
            size: tuple[float, ...] = (float(dot[k]) / max(precision, 1e-300),)
        else:
            gram = z[:, mine].T @ z[:, mine] + np.diag(board.spreads[mine] ** -2)
            solved = np.linalg.solve(gram, dot[mine])
            t = float(np.sqrt(max(float(dot[mine] @ solved), 0.0)))
            size = tuple(float(s) for s in solved)
        length = board.lengths[v][mine].max()
        share = float(np.sqrt(gram_diagonal[mine].max()) / length) if length > 0 else 0.0
        reach = float(np.sqrt(gram_diagonal[mine].max()) * board.spreads[mine].max())
        out.append(Score(h, gain if share > 0 else 0.0, t, size, share, reach > 3.0))
    return out


def _moments(board: Board, v: int) -> tuple[Array, Array, Array]:
    z = board.projected[v]
    return z.T @ board.views[v].residual, np.einsum("na,na->a", z, z), z


def _log_bayes(
    h: Hypothesis, mine: NDArray[np.intp], dot: Array, gram: Array, z: Array, spreads: Array
) -> float:
    amplitude = h.effect.amplitude
    if len(mine) > 1:
        matrix = z[:, mine].T @ z[:, mine]
        precision = matrix + np.diag(spreads[mine] ** -2)
        solved = np.linalg.solve(precision, dot[mine])
        return (
            0.5 * float(dot[mine] @ solved)
            - 0.5 * float(np.linalg.slogdet(precision)[1])
            - float(np.sum(np.log(spreads[mine])))
        )
    k = mine[0]
    if amplitude.fixed is not None:
        return float(amplitude.fixed * dot[k] - 0.5 * amplitude.fixed**2 * gram[k])
    precision = gram[k] + spreads[k] ** -2
    mean = dot[k] / precision
    out = 0.5 * mean * dot[k] - 0.5 * np.log(precision) - np.log(spreads[k])
    if amplitude.sign:
        from scipy.special import log_ndtr

        out += np.log(2.0) + float(log_ndtr(amplitude.sign * mean * np.sqrt(precision)))
    return float(out)


def by_claim(found: Sequence[Score]) -> list[Score]:
    """One score per claim (effect and place), best first: shapes averaged in the gain, the best one shown.

    A single claim's gain also carries the effect's prior weight.
    """
    groups: dict[object, list[Score]] = {}
    for score in found:
        groups.setdefault(score.hypothesis.key, []).append(score)
    out = []
    for group in groups.values():
        best = max(group, key=lambda s: s.gain)
        gains = np.array([s.gain for s in group])
        mean = float(log_mean_exp(gains)) + float(np.log(best.hypothesis.effect.prior)) - best.hypothesis.cost
        out.append(replace(best, gain=mean))
    return sorted(out, key=lambda s: -s.gain)
