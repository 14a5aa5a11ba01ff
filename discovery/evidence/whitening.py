"""The residual as the noise model sees it: whitened, with everything that a refit would absorb projected out.

What is left of a signature under this projection is all that can ever speak for its effect; evidence is
integrated over a few levels of slow sensor noise and small random heat, because their true levels are never
known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.fitting import Fit, Noise
from discovery.fitting.kalman import Filter, make_filter

Array = NDArray[np.float64]

_AT_BOUND = 1e-6


@dataclass(frozen=True)
class View:
    """One fit seen under one noise setting.

    `residual` (N,) has what a refit absorbs projected out. `level` is the log-likelihood of the fit with all
    unknowns integrated out.
    """

    lens: Lens
    noise: Noise
    residual: Array
    level: float
    information: Array  # (U, U) of the free unknowns, prior included

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis (N, U) of what a refit absorbs; made where columns are projected, for a search
        keeps many views of which it asks for no more than the level.
        """
        return self.lens.seen(self.noise)[1]

    def project(self, columns: Array) -> Array:
        """Columns (N, M) without what a refit absorbs."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


@dataclass(frozen=True)
class Lens:
    """A fit with its whitening filters: makes views and whitens columns for them."""

    fit: Fit

    @cached_property
    def priors(self) -> tuple[Array, Array]:
        """What priors add to the least squares: residual (K,) and derivative (K, U)."""
        return self.fit.problem.prior_rows(self.fit.theta, self.fit.together)

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
        """Sensitivities by recording, (R, Y, U)."""
        return [self.fit.problem.jacobian(t) for t in self.fit.trajectories]

    @cached_property
    def moving(self) -> NDArray[np.intp]:
        """Unknowns that do not press against a bound."""
        low, high = self.fit.problem.bounds
        theta = self.fit.theta
        scale = _AT_BOUND * np.maximum(1.0, np.abs(theta))
        return np.flatnonzero((theta > low + scale) & (theta < high - scale))

    def whiten(self, noise: Noise, columns: Sequence[Array]) -> tuple[Array, float]:
        """Columns (R, Y, M) by recording whitened and stacked, zero rows for priors; the log-determinant."""
        parts, logdet = [], 0.0
        for part, column in zip(self.filters, columns, strict=True):
            white, half = part.apply(noise, column)
            parts.append(white)
            logdet += half
        parts.append(np.zeros((len(self.priors[0]), columns[0].shape[2])))
        return np.concatenate(parts), logdet

    def beyond(self, view: View, unknown: int) -> float:
        """Log-likelihood that an unknown at its bound would add if it could leave it, to second order."""
        column = self.whiten(view.noise, [j[:, :, [unknown]] for j in self.jacobians])[0]
        slope = self.priors[1]
        if len(slope):
            column[-len(slope) :, 0] = slope[:, unknown]
        x = view.project(column)[:, 0]
        return 0.5 * float(x @ view.residual) ** 2 / max(float(x @ x), 1e-30)

    def seen(self, noise: Noise) -> tuple[Array, Array, Array, Array, float]:
        """Whitened residual (N,) with the priors, an orthonormal basis (N, U) of what a refit absorbs, its
        triangle (U, U) and scale (U,), and the log-determinant.
        """
        joined = [
            np.concatenate([r[:, :, None], j], axis=2)
            for r, j in zip(self.residuals, self.jacobians, strict=True)
        ]
        stacked, logdet = self.whiten(noise, joined)
        r, x = stacked[:, 0].copy(), stacked[:, 1:].copy()
        residual, slope = self.priors
        if len(residual):
            r[-len(residual) :], x[-len(residual) :] = -residual, slope
        x = x[:, self.moving]
        scale = np.maximum(np.linalg.norm(x, axis=0), 1e-30)
        basis, triangle = np.linalg.qr(x / scale)
        return r, basis, triangle, scale, logdet

    def view(self, noise: Noise) -> View:
        """The fit under one noise setting."""
        r, basis, triangle, scale, logdet = self.seen(noise)
        logdet += sum(np.log(u.prior[1]) for u in self.fit.problem.unknowns if u.prior)
        logdet -= 0.5 * np.log(self.fit.together) * sum(u.is_offset for u in self.fit.problem.unknowns)
        diagonal = np.abs(np.diag(triangle))
        keep = diagonal > 1e-9
        projected = r - basis @ (basis.T @ r)
        volume = float(np.sum(np.log(diagonal[keep])) + np.sum(np.log(scale[keep])))
        level = -logdet - 0.5 * float(projected @ projected) - volume
        information = (triangle.T @ triangle) * np.outer(scale, scale)
        return View(self, noise, projected, level, information)


def log_mean_exp(values: Array, axis: int = 0) -> Array:
    """log of the mean of exp, safely."""
    top = np.max(values, axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    return np.asarray(np.squeeze(top, axis) + np.log(np.mean(np.exp(values - top), axis=axis)))
