"""Bayes factors of effects with a non-local prior of their size, vectorised.

The size a of an effect has a log-normal prior: zero at zero, so that "nothing" wins where sizes are small
(Johnson & Rossell, J. R. Stat. Soc. B 72, 2010), with tails that let it be large. Under a Gaussian likelihood
with optimum m and variance v,

    log BF = m^2/(2 v) + log int p(a) exp(-(a - m)^2/(2 v)) da

which is a one-dimensional integral; shape parameters, noise settings and instants are summed over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray

from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.settings import Setting
from discovery.evidence.signatures import Claims
from discovery.evidence.whitening import Absorbed, Whitened, absorbed, log_sum_exp
from discovery.fitting import Noise
from discovery.threads import side_by_side

Array = NDArray[np.float64]

_NODES, _WEIGHTS = hermegauss(11)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
_FINE = np.linspace(-3.5, 3.5, 43)  # standard deviations of the logarithm, for flat likelihoods
_NARROW = 4.0  # standard deviations from zero beyond which the posterior is taken as Gaussian
_BATCH = 256  # hypotheses whose signatures are whitened at a time
ROUNDING = 1e-9  # of the square of a signature: what is left of less is lost in the last digits


@dataclass(frozen=True)
class Slab:
    """Prior of sizes (A,): `median` of their magnitudes, 68 % within `factor`, sign +1, -1 or 0 (either)."""

    median: Array
    factor: Array
    sign: Array

    def take(self, index: NDArray[np.intp]) -> Slab:
        """The prior of some of the sizes."""
        return Slab(self.median[index], self.factor[index], self.sign[index])

    def density(self, size: Array) -> Array:
        """Prior density at sizes (..., A)."""
        width = np.log(self.factor)
        with np.errstate(divide="ignore"):
            logs = np.log(np.abs(size) / self.median)
        share = np.where(self.sign == 0, 0.5, (np.sign(size) == self.sign).astype(float))
        near = np.exp(-0.5 * (logs / width) ** 2) / (np.abs(size) + 1e-300) / (width * np.sqrt(2 * np.pi))
        return np.asarray(share * near)

    def average(self, mean: Array, variance: Array) -> Array:
        """log of the prior density, averaged over Gaussian sizes of `mean` (A,) and `variance` (A,)."""
        sd = np.sqrt(np.maximum(variance, 1e-300))
        narrow = (np.abs(mean) > _NARROW * sd) & (self.sign * mean >= 0)
        out = np.zeros(len(mean))
        for flat in (False, True):
            index = np.flatnonzero(narrow != flat)
            if len(index):
                part = self.take(index)
                out[index] = (
                    part._wide(mean[index], sd[index]) if flat else part._narrow(mean[index], sd[index])
                )
        return out

    def _narrow(self, mean: Array, sd: Array) -> Array:
        near = self.density(mean + sd * _NODES[:, None])
        return np.asarray(np.log(np.maximum(_WEIGHTS @ near, 1e-300)))

    def _wide(self, mean: Array, sd: Array) -> Array:
        wide = np.full(len(mean), -np.inf)
        size = self.median / sd * self.factor ** _FINE[:, None]
        prior = np.log((_FINE[1] - _FINE[0]) / (2 * np.pi * sd)) - 0.5 * _FINE[:, None] ** 2
        for sign in (1.0, -1.0):
            can = np.flatnonzero(self.sign != -sign)  # what has the wrong sign cannot be
            part = prior[:, can] - 0.5 * (sign * size[:, can] - mean[can] / sd[can]) ** 2
            share = np.where(self.sign[can] == 0, np.log(0.5), 0.0)
            wide[can] = np.logaddexp(wide[can], share + log_sum_exp(part))
        return wide


@dataclass(frozen=True)
class Score:
    """Score of a candidate in the linear scan.

    `gain`: log Bayes factor against the model without it, integrated over noise settings and shapes; `t` the
    signed score in standard deviations at the best of them, `size` its amplitudes there, `share` what a refit
    leaves of the signature. `odds`: with the prior odds of its place.
    """

    hypothesis: Hypothesis
    gain: float
    t: float
    size: tuple[float, ...]
    share: float
    noise: int  # setting at which it is largest

    @property
    def odds(self) -> float:
        """Log posterior odds against the model without it."""
        return self.gain + self.hypothesis.log_odds


@dataclass(frozen=True)
class Projected:
    """Signatures (N, A) of hypotheses under one noise, seen through what a refit absorbs: `dot` (A,) with the
    residual, `gram` (A,) with themselves, `length` (A,) before the projection.
    """

    columns: Array
    inside: Array  # (U, A) the signatures along the basis of what a refit absorbs
    dot: Array
    gram: Array
    length: Array

    def block(self, index: Sequence[int] | NDArray[np.intp]) -> Array:
        """Gram matrix of some of the signatures."""
        z, inside = self.columns[:, list(index)], self.inside[:, list(index)]
        return np.asarray(z.T @ z - inside.T @ inside)


def project(seen: Whitened, setting: Setting, columns: Sequence[Array]) -> Projected:
    """Columns (R, Y, A) by recording, whitened, with everything that a refit would absorb projected out."""
    return projected(seen.whiten(setting.noise, columns)[0], seen.absorbed(setting.noise))


def project_one(seen: Whitened, noise: Noise, gone: Absorbed, recording: int, columns: Array) -> Projected:
    """As `project`, of columns (R, Y, A) that are zero but in one recording, where a refit absorbs what is
    `gone`.
    """
    here, z = seen.places[recording], seen.whiten_one(noise, recording, columns)
    return projected(z, replace(gone, residual=gone.residual[here], basis=gone.basis[here]))


def projected(z: Array, gone: Absorbed) -> Projected:
    """Whitened signatures (N, A), seen through what a refit absorbs."""
    inside = gone.basis.T @ z
    length = np.einsum("na,na->a", z, z)
    left = length - np.einsum("ua,ua->a", inside, inside)
    gram = np.maximum(left, ROUNDING * length)  # of what a refit absorbs whole, rounding is left
    return Projected(z, inside, z.T @ gone.residual - inside.T @ gone.slope, gram, np.sqrt(length))


@dataclass(frozen=True)
class Without:
    """One of the effects of a fit taken out again: what it shows (R, Y) by recording, and its columns (K,)
    among the unknowns that move.
    """

    shown: tuple[Array, ...]
    columns: NDArray[np.intp]


@dataclass(frozen=True)
class Scores:
    """Candidates scored on the residual of a fit, best odds first; `without`: on that without one of its
    effects, to first order, for each of them; `quiet`: on that of the fit, as if the last noise setting were
    the only one.
    """

    claims: list[Score]
    without: list[list[Score]]
    quiet: list[Score]


def scan(
    seen: Whitened,
    settings: Sequence[Setting],
    hypotheses: Sequence[Hypothesis],
    slab: Slab,
    without: Sequence[Without] = (),
) -> Scores:
    """Score every candidate on the residual of a fit.

    Args:
        settings: noise settings to integrate over, the one with least process noise last.
        hypotheses: claims at all their shape values.
        slab: prior of each amplitude, in their order.
        without: effects of the fit to be taken out, one at a time.
    """
    runs = seen.fit.trajectories
    batches = _batches(hypotheses)

    def shown_by(batch: Sequence[Hypothesis]) -> list[Array]:
        claims = Claims.of(batch, runs[0].system.model)
        return [claims.signatures(t) for t in runs]

    columns = side_by_side(shown_by, batches)
    back = [np.stack([w.shown[k] for w in without], axis=2) for k in range(len(runs))] if without else []
    levels = np.zeros((1 + len(without), len(settings)))
    parts: list[list[Products]] = [[] for _ in levels]
    for k, setting in enumerate(settings):
        rows, log = seen.rows(setting.noise)  # the filter is made here, for all batches
        gone = [seen.absorbed(setting.noise)]
        shown = seen.whiten(setting.noise, back)[0] if without else rows[:, :0]
        for i, one in enumerate(without):
            kept = np.setdiff1d(np.arange(rows.shape[1]), 1 + one.columns)
            fewer = rows[:, kept]
            fewer[:, 0] += shown[:, i]
            gone.append(absorbed(fewer, seen.prior[0][np.ix_(kept, kept)]))

        def looked(
            pair: tuple[Sequence[Hypothesis], list[Array]],
            noise: Noise = setting.noise,
            gone: Sequence[Absorbed] = gone,
        ) -> list[Products]:
            z = seen.whiten(noise, pair[1])[0]
            return [products(projected(z, view), pair[0]) for view in gone]

        pieces = side_by_side(looked, list(zip(batches, columns, strict=True)))
        for i, part in enumerate(parts):
            part.append(_joined([piece[i] for piece in pieces]))
        levels[:, k] = [view.level - float(log.sum()) + setting.log_weight for view in gone]
    first, *others = [ranked(hypotheses, slab, *both) for both in zip(levels, parts, strict=True)]
    quiet = ranked(hypotheses, slab, levels[0, -1:], parts[0][-1:]) if len(settings) > 1 else first
    return Scores(first, others, quiet)


def _batches(hypotheses: Sequence[Hypothesis]) -> list[Sequence[Hypothesis]]:
    """Hypotheses in the order in which they come, so many at a time that their columns fit into memory."""
    return [hypotheses[k : k + _BATCH] for k in range(0, len(hypotheses), _BATCH)]


@dataclass(frozen=True)
class Products:
    """Inner products of the signatures (A,) of hypotheses under one noise, as in `Projected`.

    `matrices` (H,): those of the signatures of each hypothesis with each other, (K, K).
    """

    dot: Array
    gram: Array
    length: Array
    matrices: tuple[Array, ...]


def products(part: Projected, hypotheses: Sequence[Hypothesis]) -> Products:
    """Inner products of the signatures of hypotheses, in their order."""
    edges = np.concatenate([[0], np.cumsum([len(h.amplitudes) for h in hypotheses])]).tolist()
    least = ROUNDING * (part.length**2 + 1e-30)
    matrices = tuple(
        np.maximum(part.gram[a:b], least[a:b])[:, None]
        if b - a == 1
        else part.block(range(a, b)) + np.diag(least[a:b])
        for a, b in pairwise(edges)
    )
    return Products(part.dot, part.gram, part.length, matrices)


def _joined(pieces: Sequence[Products]) -> Products:
    def whole(name: str) -> Array:
        return np.concatenate([np.zeros(0), *(getattr(piece, name) for piece in pieces)])

    return Products(
        whole("dot"), whole("gram"), whole("length"), tuple(m for p in pieces for m in p.matrices)
    )


def ranked(
    hypotheses: Sequence[Hypothesis], slab: Slab, levels: Array, parts: Sequence[Products]
) -> list[Score]:
    """One score for each claim, over noise settings (S,) and shapes, best odds first.

    Args:
        slab: prior of each amplitude, in the order of the hypotheses.
        levels: (S,) log likelihood of the model without them, under each noise setting.
        parts: what the signatures say under each.
    """
    if not hypotheses:
        return []
    counts = np.array([len(h.amplitudes) for h in hypotheses])
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    fixed = np.array([h.effect.amplitude.fixed or 0.0 for h in hypotheses])
    factors = np.array([_factors(p, first, counts, fixed, slab) for p in parts])
    weights = np.array([h.log_weight for h in hypotheses])
    total = float(log_sum_exp(levels))
    with np.errstate(invalid="ignore"):
        gains = log_sum_exp(levels[:, None] + factors) - total
    best = np.argmax(levels[:, None] + factors, axis=0)
    groups: dict[object, list[int]] = {}
    for i, h in enumerate(hypotheses):
        groups.setdefault(h.key, []).append(i)
    found = []
    for mine in groups.values():
        top = max(mine, key=lambda i: gains[i] + weights[i])
        joint = float(log_sum_exp(np.array([gains[i] + weights[i] for i in mine])))
        found.append(_score(hypotheses[top], joint, parts[best[top]], top, int(best[top]), first[top]))
    return sorted(found, key=lambda s: -s.odds)


def _factors(
    part: Products, first: NDArray[np.intp], counts: NDArray[np.intp], fixed: Array, slab: Slab
) -> Array:
    """Log Bayes factor (H,) of each hypothesis under one noise."""
    gram = np.maximum(part.gram, 1e-30)
    mean, variance = part.dot / gram, 1.0 / gram
    alone = 0.5 * part.dot**2 / gram + slab.average(mean, variance) + 0.5 * np.log(2 * np.pi * variance)
    out = np.where(counts == 1, alone[first], 0.0)
    on = np.flatnonzero(fixed)
    out[on] = fixed[on] * part.dot[first[on]] - 0.5 * fixed[on] ** 2 * part.gram[first[on]]
    for i in np.flatnonzero(counts != 1):
        mine = np.arange(first[i], first[i] + counts[i])
        out[i] = _jointly(part.matrices[i], part.dot[mine], slab.take(mine))
    return np.where(part.length[first] <= 0, -np.inf, out)


def _jointly(matrix: Array, dot: Array, slab: Slab) -> float:
    """Log Bayes factor of an effect with several amplitudes. One that the first order gives the wrong sign
    does not count: a refit says what it is once the others act.
    """
    scale = np.sqrt(np.diag(matrix))
    sizes, axes = np.linalg.eigh(matrix / np.outer(scale, scale))
    sizes = np.maximum(sizes, ROUNDING)  # two signatures may look the same
    inverse = axes / sizes @ axes.T / np.outer(scale, scale)
    at = inverse @ dot
    wrong = (at * slab.sign < 0) & (np.abs(at) > np.sqrt(np.diag(inverse)))
    if wrong.any() and not wrong.all():
        kept = np.flatnonzero(~wrong)
        return _jointly(matrix[np.ix_(kept, kept)], dot[kept], slab.take(kept))
    return (
        0.5 * float(dot @ at)
        + float(np.sum(slab.average(at, np.diag(inverse))))
        + 0.5 * len(dot) * float(np.log(2 * np.pi))
        - 0.5 * float(np.sum(np.log(sizes)) + 2 * np.sum(np.log(scale)))
    )


def _score(h: Hypothesis, gain: float, part: Products, index: int, noise: int, first: int) -> Score:
    mine = slice(first, first + len(h.amplitudes))
    dot, matrix = part.dot[mine], part.matrices[index]
    size = np.linalg.solve(matrix, dot)
    t = float(np.sqrt(max(float(dot @ size), 0.0)))
    t = float(np.copysign(t, size[0])) if len(dot) == 1 else t
    length = float(part.length[mine].max())
    share = float(np.sqrt(part.gram[mine].max())) / length if length > 0 else 0.0
    return Score(h, gain, t, tuple(size.tolist()), share, noise)
