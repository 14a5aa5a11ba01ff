"""Folds over recordings (or blocks of a single one), and the choice of a size by them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

_MOST_FOLDS = 4
# Default tolerances in standard errors: of a model that is to predict, of one whose terms are read, and of a
# term that is claimed to be missing from a hand-built model.
PREDICT, NAME, CLAIM = 1.0, 2.0, 3.0


@dataclass(frozen=True)
class Blocks:
    """Contiguous pieces of the recordings, in their order. `of` holds for each recording the block of each
    reading.
    """

    of: tuple[Ints, ...]  # (R,) each
    recording: Ints  # (B,) index of the recording

    @property
    def count(self) -> int:
        """Number of blocks."""
        return len(self.recording)


def make_blocks(times: Sequence[Array], count: int) -> Blocks:
    """Cut recordings with readings at `times` [s] into about `count` blocks of equal duration, at least one
    each. A piece without readings, as in a pause of the logger, is no block: it has nothing to leave out.

    A single recording is cut into at least eight, so that it can be left out in parts.
    """
    spans = [max(float(t[-1] - t[0]), 1.0) if len(t) else 1.0 for t in times]
    width = sum(spans) / count
    of, recording, first = [], [], 0
    for i, (t, span) in enumerate(zip(times, spans, strict=True)):
        pieces = max(8 if len(times) == 1 else 1, round(span / width))
        share = (t - t[0]) / span if len(t) else t
        piece = np.minimum((share * pieces).astype(np.intp), pieces - 1)
        filled, block = np.unique(piece, return_inverse=True)
        of.append(first + block.astype(np.intp))
        recording += [i] * max(len(filled), 1)
        first += max(len(filled), 1)
    return Blocks(tuple(of), np.array(recording, dtype=np.intp))


def make_folds(blocks: Blocks, whole: bool = True) -> list[Ints]:
    """Blocks that each fold leaves out: one recording at a time (several if there are many), else a quarter
    of the one.

    Args:
        whole: leave out whole recordings where there are several. Else a quarter of each: recordings that
            were made for different things do not determine each other's part of a model.
    """
    recordings = int(blocks.recording.max()) + 1
    if recordings == 1 or not whole:
        each = [np.flatnonzero(blocks.recording == i) for i in range(recordings)]
        quarters = [np.array_split(one, _MOST_FOLDS) for one in each]
        return [np.concatenate(parts) for parts in zip(*quarters, strict=True)]
    folds = min(recordings, _MOST_FOLDS)
    return [np.flatnonzero(blocks.recording % folds == k) for k in range(folds)]


def bootstraps(blocks: int, count: int, seed: int) -> Iterator[Array]:
    """How often each block (B,) is drawn in each of `count` block bootstraps."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.multinomial(blocks, np.full(blocks, 1 / blocks)).astype(float)


def choose(errors: Array, tolerance: float) -> int:
    """The sparsest row whose error on left-out data is within `tolerance` standard errors of the best.

    The standard error is that of the paired difference over blocks, of the logarithms and of the squares
    alike: logarithms hold where recordings of different violence stand side by side, squares where the
    informative events happen in few blocks.

    Args:
        errors: (sizes, B) mean squared error of each left-out block, sparsest model first.
    """
    best = int(np.argmin(errors.mean(axis=1)))
    least = max(1e-12 * float(errors.max()), 1e-300)  # a block without readings has no error
    scales = (np.log(np.maximum(errors, least)), errors)
    for row in range(best):
        if all(_within(scale[row] - scale[best], tolerance) for scale in scales):
            return row
    return best


def _within(difference: Array, tolerance: float) -> bool:
    """Whether the mean of a difference (B,) is within so many of its standard errors of zero, or below it."""
    spread = difference.std(ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else 0.0
    return bool(difference.mean() <= tolerance * spread)
