"""Whitened rows of readings, and what is kept of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Rows:
    """Whitened rows (N, C) by recording, in the order of time, of the C columns of all `size` that act there;
    `blocks`: where each block of time begins among them, and where the last one ends; `logdet` (B,) by block.
    """

    size: int
    rows: tuple[Array, ...]
    columns: tuple[Ints, ...]
    blocks: tuple[Ints, ...]
    logdet: Array

    @cached_property
    def sums(self) -> Array:
        """The normal equations (size, size) of all rows."""
        found = np.zeros((self.size, self.size))
        for rows, columns in zip(self.rows, self.columns, strict=True):
            found[np.ix_(columns, columns)] += rows.T @ rows
        return found

    def by_block(self) -> Array:
        """The normal equations (B, size, size) of each block. They are large, and few noises need them."""
        found = np.zeros((len(self.logdet), self.size, self.size))
        pieces = iter(found)
        for rows, columns, edges in zip(self.rows, self.columns, self.blocks, strict=True):
            place = np.ix_(columns, columns)
            for a, b in pairwise(edges.tolist()):
                next(pieces)[place] = rows[a:b].T @ rows[a:b]
        return found

    def lighter(self) -> Rows:
        """The same normal equations, of each block and of all, from fewer rows where blocks are long: each
        keeps the triangular factor of its rows (Q R; R^T R are their normal equations).
        """
        if all(
            len(rows) <= 2 * len(c) * len(e)
            for rows, c, e in zip(self.rows, self.columns, self.blocks, strict=True)
        ):
            return self
        short = [
            [np.linalg.qr(rows[a:b], mode="r") for a, b in pairwise(edges.tolist())]
            for rows, edges in zip(self.rows, self.blocks, strict=True)
        ]
        edges = [np.cumsum([0, *(len(block) for block in blocks)]) for blocks in short]
        return replace(self, rows=tuple(np.concatenate(blocks) for blocks in short), blocks=tuple(edges))
