"""A fit under a noise model: whitened residual and sensitivities, stored as normal equations of each block.

All later results (evidence with all unknowns integrated out, the part of a signature that a refit would
absorb, the posterior on resampled blocks) are algebra on these small matrices:

    log p(y) = -log det L - 1/2 (r'r - b' H^-1 b) - 1/2 log det H + priors,   H = J'J + priors, b = J'r

with r and J whitened by the Kalman filter of `fitting/kalman.py` (Laplace's approximation; MacKay, Neural
Computation 4, 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.evidence.rows import Rows
from discovery.fitting import Fit, Noise
from discovery.fitting.kalman import Filter, make_filter

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

_AT_BOUND = 1e-6
_UNSEEN = 1e-20  # of the largest entry of the normal equations
_ROUNDING = 1e-10  # of the diagonal, added to it
_TOGETHER = 16  # draws at a time: so many normal equations stay near the processor
_REMEMBERED = 8  # rows under the last noises; they differ in form errors next, and are large


@dataclass(frozen=True)
class Grams:
    """A fit under one noise setting. Columns are the residual, then the unknowns that do not press against a
    bound: `rows` of the readings, `prior` (1 + U, 1 + U) of the priors, `constant` what their densities add.
    `scale` (1 + U,) multiplies the columns: form errors of any share are the same rows. The last `form` of
    them are form errors: how wide these are is part of the noise.
    """

    noise: Noise
    rows: Rows
    prior: Array
    constant: float
    scale: Array
    form: int = 0

    def level(self) -> float:
        """Log-likelihood with all unknowns integrated out."""
        return float(self.marginal(np.zeros(0, dtype=np.intp))[0][0, 0])

    def solved(self) -> tuple[float, Array, Array]:
        """The level, the step (U,) from where the fit stands to its optimum under this noise, and the
        covariance (U, U) there.
        """
        every = np.arange(self.prior.shape[0] - 1)
        levels, steps, covariances = self.marginal(every)
        return float(levels[0, 0]), steps[0, 0], covariances[0, 0]

    @property
    def ahead(self) -> float:
        """Log-likelihood by which the optimum under this noise lies above the fit, to first order; form
        errors, which come last, are free at both.
        """
        _, step, covariance = self.solved()
        own = len(step) - self.form
        return 0.5 * float(step[:own] @ np.linalg.solve(covariance[:own, :own], step[:own])) if own else 0.0

    def without(self, extra: Array) -> Grams:
        """The same without the last columns, whose coefficients have the spreads `extra` (E,)."""
        kept = self.prior.shape[0] - len(extra)
        constant = self.constant + float(np.sum(np.log(extra)))
        form = self.form - len(extra)
        return Grams(self.noise, self.rows, self.prior[:kept, :kept], constant, self.scale[:kept], form)

    def marginal(
        self, sizes: Ints, weights: Array | None = None, widths: Sequence[float] = (1.0,)
    ) -> tuple[Array, Array, Array]:
        """Log-likelihoods (W, D) with all unknowns integrated out, for several draws at once; the step
        (W, D, A) of some unknowns from where the fit stands to the optimum, and their covariance
        (W, D, A, A) there.

        Args:
            sizes: (A,) indices of the unknowns.
            weights: (D, B) how often each block counts; default each once.
            widths: (W,) of the priors, relative to what they are; form errors keep theirs.
        """
        return self.marginals(sizes, np.zeros(0), weights, widths)[-1]

    def marginals(
        self, sizes: Ints, extra: Array, weights: Array | None = None, widths: Sequence[float] = (1.0,)
    ) -> list[tuple[Array, Array, Array]]:
        """As `marginal`: without the last columns, whose coefficients have the spreads `extra` (E,), and with
        them; once, where there are none.

        With the columns in the order of the other unknowns, the last columns, `sizes`, residual, one Cholesky
        factor holds everything: its last row is the slope along the others and what is left of the residual,
        and the corner before it is the root of the precision of the sizes after a refit of the others.
        """
        count, few, more = self.prior.shape[0], len(sizes), len(extra)
        last = np.arange(count - 1 - more, count - 1)
        others = np.delete(np.arange(count - 1 - more), sizes)
        order = np.concatenate([1 + others, 1 + last, 1 + np.asarray(sizes, dtype=np.intp), [0]])
        first = len(others)
        pieces = self.rows.sums[None] if weights is None else self.rows.by_block()
        places = np.add.outer(order * self.rows.size, order).ravel()
        whole = np.take(pieces.reshape(len(pieces), -1), places, axis=1)
        whole *= np.outer(self.scale[order], self.scale[order]).ravel()
        prior = self.prior[np.ix_(order, order)]
        of_form = order >= count - self.form
        fixed = np.where(np.logical_and.outer(of_form, of_form), prior, 0.0).ravel()
        prior = prior.ravel() - fixed
        widened = np.count_nonzero(np.diag(self.prior)[1 : count - self.form])
        often = np.ones((1, 1)) if weights is None else weights
        volume = np.empty((len(widths), len(often)))
        corner = np.empty((*volume.shape, count - first, count - first))
        for begin in range(0, len(often), _TOGETHER):
            some = slice(begin, begin + _TOGETHER)
            total = often[some] @ whole
            for k, wide in enumerate(widths):
                chol = _factor((total + fixed + prior / wide**2).reshape(-1, count, count))
                volume[k, some] = np.sum(np.log(np.einsum("dii->di", chol)[:, :first]), axis=1)
                corner[k, some] = chol[:, first:, first:]
        dets = -float(self.rows.logdet.sum()) if weights is None else -weights @ self.rows.logdet
        wider = widened * np.log(widths)[:, None]
        found = []
        if more:
            rest = corner[:, :, more:]  # without the form errors
            bare = np.linalg.cholesky(rest @ rest.swapaxes(2, 3))
            constant = self.constant + float(np.sum(np.log(extra)))
            found.append(_concluded(bare, few, dets - volume + constant - wider))
        volume = volume + np.sum(np.log(np.diagonal(corner[:, :, :more, :more], 0, 2, 3)), axis=2)
        found.append(_concluded(corner[:, :, more:, more:], few, dets - volume + self.constant - wider))
        return found


def _factor(matrices: Array) -> Array:
    """Cholesky factors of normal equations (D, U, U), changed so that none fails in the last digits."""
    diagonals = np.einsum("dii->di", matrices)
    least = _UNSEEN * diagonals.max(axis=1, initial=1e-300)
    diagonals += _ROUNDING * np.maximum(diagonals, least[:, None])
    return np.asarray(np.linalg.cholesky(matrices))


def _concluded(corner: Array, few: int, level: Array) -> tuple[Array, Array, Array]:
    """Level, step and covariance of `marginal` from the corner (W, D, A + 1, A + 1) of the factor, and the
    level without what the corner adds.
    """
    own, along, left = corner[..., :few, :few], corner[..., few, :few], corner[..., few, few]
    root = np.linalg.inv(own)
    step = np.einsum("wdji,wdj->wdi", root, along)
    level = level - np.sum(np.log(np.diagonal(own, 0, 2, 3)), axis=2) - 0.5 * left**2
    return level, step, root.swapaxes(2, 3) @ root


@dataclass(frozen=True)
class Whitened:
    """A fit with its whitening filters."""

    fit: Fit
    blocks: int  # of time in each recording
    extra: tuple[Array, ...] = ()  # by recording (R, Y, E): what may act with coefficients ...
    spread: Array = field(default_factory=lambda: np.zeros(0))  # (E,) ... that are known to be about zero
    form: tuple[int, ...] = (0, 0)  # of them, the first: form errors of laws, then of edges, of a model; more
    last: dict[str, Any] = field(default_factory=dict, repr=False)

    def absorbed(self, noise: Noise) -> Absorbed:
        """What a refit absorbs under a noise; the last noise is kept."""
        if "basis" not in self.last or self.last["basis"][0] != noise:
            self.last["basis"] = (noise, absorbed(self.rows(noise)[0], self.prior[0]))
        known: Absorbed = self.last["basis"][1]
        return known

    @cached_property
    def filters(self) -> list[Filter]:
        """Whitening filter of each recording."""
        return [make_filter(t) for t in self.fit.trajectories]

    @cached_property
    def residuals(self) -> list[Array]:
        """Readings minus model by recording, (R, Y)."""
        return [self.fit.problem.residual(t) for t in self.fit.trajectories]

    @cached_property
    def jacobians(self) -> list[Array]:
        """Sensitivities of the outputs by recording, (R, Y, U + E), of the unknowns that are free to move and
        of the extra columns.
        """
        own = [self.fit.problem.jacobian(t)[:, :, self.moving] for t in self.fit.trajectories]
        if not self.extra:
            return own
        return [np.concatenate([j, e], axis=2) for j, e in zip(own, self.extra, strict=True)]

    @cached_property
    def moving(self) -> Ints:
        """Unknowns that are not at a bound."""
        return moving(self.fit)

    @cached_property
    def block(self) -> Ints:
        """Block (N,) of each whitened reading, counted through the recordings."""
        found = []
        for k, t in enumerate(self.fit.trajectories):
            grid = t.system.grid
            share = (grid.time[grid.read] - grid.time[0]) / max(float(grid.time[-1] - grid.time[0]), 1e-9)
            number = np.minimum((share * self.blocks).astype(int), self.blocks - 1) + k * self.blocks
            found.append(np.broadcast_to(number[:, None], grid.measured.shape)[grid.measured])
        return np.concatenate(found)

    @cached_property
    def places(self) -> list[slice]:
        """Where the whitened readings of each recording stand."""
        counts = [int(np.count_nonzero(p.measured)) for p in self.filters]
        edges = np.concatenate([[0], np.cumsum(counts)]).tolist()
        return [slice(a, b) for a, b in pairwise(edges)]

    def whiten(self, noise: Noise, columns: Sequence[Array]) -> tuple[Array, Array]:
        """Columns (R, Y, M) by recording whitened and stacked (N, M), and the logarithms (N,) of the standard
        deviations of the innovations.
        """
        bare = _bare(noise)
        parts = [p.whitened(bare, c) for p, c in zip(self.filters, columns, strict=True)]
        return np.concatenate([z for z, _ in parts]), np.concatenate([log for _, log in parts])

    def whiten_one(self, noise: Noise, recording: int, columns: Array) -> Array:
        """Columns (R, Y, M) of one recording whitened, (readings of it, M)."""
        return self.filters[recording].whitened(_bare(noise), columns)[0]

    def rows(self, noise: Noise) -> tuple[Array, Array]:
        """Whitened residual and sensitivities (N, 1 + U), logarithms (N,) as in `whiten`."""
        rows, log = self._rows(_unit(noise))
        return rows * self._scale(noise), log

    def _rows(self, unit: Noise) -> tuple[Array, Array]:
        """The rows with a form error of one; those of the last noise are kept."""
        if "rows" not in self.last or self.last["rows"][0] != unit:
            parts = [self._part(k, unit) for k in range(len(self.filters))]
            rows = np.zeros((len(self.block), self.jacobians[0].shape[2] + 1))
            for here, (columns, _), (part, _) in zip(self.places, self._joined(unit), parts, strict=True):
                rows[here, columns] = part
            self.last["rows"] = (unit, (rows, np.concatenate([log for _, log in parts])))
        known: tuple[Array, Array] = self.last["rows"][1]
        return known

    def _joined(self, unit: Noise) -> list[tuple[Ints, Array]]:
        """By recording, which of the columns of 1 + U + E act there (C,), and residual and sensitivities
        (R, Y, C) of these: starts and offsets belong to one recording, and form errors of a share of zero act
        nowhere.
        """
        key = f"joined {unit.form:g} {unit.edge:g}"
        if key not in self.last:
            on = self._scale(unit)[1:] > 0
            acting = [np.flatnonzero(j.any(axis=(0, 1)) & on) for j in self.jacobians]
            self.last[key] = [
                (
                    np.concatenate([[0], 1 + mine]),
                    np.ascontiguousarray(np.concatenate([r[:, :, None], j[:, :, mine]], axis=2)),
                )
                for r, j, mine in zip(self.residuals, self.jacobians, acting, strict=True)
            ]
        known: list[tuple[Ints, Array]] = self.last[key]
        return known

    def _part(self, k: int, unit: Noise) -> tuple[Array, Array]:
        """Rows (N, C) and logarithms (N,) of one recording."""
        return self.filters[k].whitened(_bare(unit), self._joined(unit)[k][1])

    def _scale(self, noise: Noise) -> Array:
        """What multiplies the columns (1 + U,) under the form error of a noise."""
        scale = np.ones(1 + len(self.moving) + len(self.spread))
        first = 1 + len(self.moving)
        laws, edges, *_ = self.form
        scale[first : first + laws] = noise.form
        scale[first + laws : first + laws + edges] = noise.edge
        return scale

    @cached_property
    def prior(self) -> tuple[Array, float]:
        """What priors add to the normal equations (1 + U, 1 + U), and the logarithm of their densities."""
        fit = self.fit
        residual, slope = fit.problem.prior_rows(fit.theta, fit.together)
        count = len(self.spread)
        rows = np.zeros((len(residual) + count, 1 + len(self.moving) + count))
        rows[: len(residual), 0] = -residual
        rows[: len(residual), 1 : 1 + len(self.moving)] = slope[:, self.moving]
        rows[len(residual) :, 1 + len(self.moving) :] = np.diag(1.0 / self.spread)
        spreads = [
            u.prior[1] / (np.sqrt(fit.together) if u.is_nuisance else 1.0)
            for u in fit.problem.unknowns
            if u.prior
        ]
        of_logs = [np.log(x) for x, u in zip(fit.theta, fit.problem.unknowns, strict=True) if u.is_log]
        logs = np.concatenate([np.log(spreads), of_logs, np.log(self.spread)])
        return rows.T @ rows, -float(np.sum(logs))

    def grams(self, noise: Noise) -> Grams:
        """The fit under one noise setting, as normal equations by block."""
        unit = _unit(noise)
        known = self.last.setdefault("grams", [])
        same: Rows | None = next((rows for other, rows in known if other == unit), None)
        if same is None:
            same = self._under(unit)
            known.append((unit, same))
            del known[:-_REMEMBERED]
        prior, constant = self.prior
        return Grams(noise, same, prior, constant, self._scale(noise), len(self.spread))

    def _under(self, unit: Noise) -> Rows:
        """The rows with a form error of one, recording by recording."""
        parts = [self._part(k, unit) for k in range(len(self.filters))]
        edges = []
        for k, here in enumerate(self.places):  # readings stand in the order of time
            numbers = np.arange(k * self.blocks, (k + 1) * self.blocks + 1)
            edges.append(np.searchsorted(self.block[here], numbers))
        dets = [
            log[a:b].sum() for (_, log), e in zip(parts, edges, strict=True) for a, b in pairwise(e.tolist())
        ]
        size = self.jacobians[0].shape[2] + 1
        columns = tuple(mine for mine, _ in self._joined(unit))
        return Rows(size, tuple(rows for rows, _ in parts), columns, tuple(edges), np.array(dets))


def moving(fit: Fit) -> Ints:
    """Unknowns of a fit that are not at a bound."""
    low, high = fit.problem.bounds
    scale = _AT_BOUND * np.maximum(1.0, np.abs(fit.theta))
    return np.flatnonzero((fit.theta > low + scale) & (fit.theta < high - scale))


@dataclass(frozen=True)
class Absorbed:
    """What a refit absorbs: `residual` (N,), a basis (N, U) whose square is what readings and priors together
    let the unknowns move, how far the residual is along it (U,), and the log likelihood that is left, without
    what does not depend on the columns.
    """

    residual: Array
    basis: Array
    slope: Array
    level: float


def absorbed(rows: Array, prior: Array) -> Absorbed:
    """What the columns of `rows` (N, 1 + U), the residual first, absorb of anything.

    Args:
        prior: (1 + U, 1 + U) normal equations of what is known of the unknowns before.
    """
    hessian = rows[:, 1:].T @ rows[:, 1:] + prior[1:, 1:]
    scale = _scale(np.diag(hessian))
    size, axes = np.linalg.eigh(hessian / np.outer(scale, scale))
    size = np.maximum(size, 1e-12)
    root = axes / np.sqrt(size) / scale[:, None]
    slope = root.T @ (rows[:, 1:].T @ rows[:, 0] + prior[1:, 0])
    quadratic = float(rows[:, 0] @ rows[:, 0]) + float(prior[0, 0]) - float(slope @ slope)
    volume = 0.5 * float(np.sum(np.log(size))) + float(np.sum(np.log(scale)))
    return Absorbed(rows[:, 0], rows[:, 1:] @ root, slope, -0.5 * quadratic - volume)


def _unit(noise: Noise) -> Noise:
    """A noise with those form errors of one that it has: they are columns, of any share the same."""
    return replace(noise, form=float(noise.form > 0), edge=float(noise.edge > 0))


def _bare(noise: Noise) -> Noise:
    """A noise without form errors: no filter depends on them."""
    return replace(noise, form=0.0, edge=0.0)


def _scale(diagonal: Array) -> Array:
    """What makes the diagonal of normal equations one; what no reading sees is kept from dividing by zero."""
    return np.asarray(np.sqrt(np.maximum(diagonal, _UNSEEN * diagonal.max(initial=1e-300))))


def log_sum_exp(values: Array, axis: int = 0) -> Array:
    """log of the sum of exp, safely."""
    top = np.max(values, axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.squeeze(top, axis) + np.log(np.sum(np.exp(values - top), axis=axis)))
