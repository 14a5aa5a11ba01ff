"""The probability of an answer: the bagged posterior over all models that the search tried.

The posterior of approximate models is too narrow: with a little more data, other priors or one recording
less, another model is the most likely one. Therefore it is averaged over resampled blocks of time (Huggins &
Miller, Bayesian Analysis 18, 2023). How wide the priors are is not known either: the evidence of each model
is integrated over wider and narrower ones, so that a width which the readings contradict has no say. The
models are not fitted again; the rest is algebra on their normal equations.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.whitening import log_sum_exp
from discovery.threads import side_by_side

Array = NDArray[np.float64]

WIDTHS = (1 / thresholds.FACTOR, 1.0, thresholds.FACTOR)  # of the priors, relative to what they are
FAR = 25.0  # log evidence below the best from which a model takes no part
MOST = 25  # models that take part
IN_PLAY = 8.0  # log evidence below the best of a model within which a noise setting counts
SETTINGS = 3  # of these, at most


@dataclass(frozen=True)
class Posterior:
    """Models and their log evidence (M, D) on each draw, the most likely model first.

    A statement is compared by the best model in which it holds and the best one in which it does not: the
    search tries more models near its answer than elsewhere, and their number must not count.
    """

    models: tuple[Scored, ...]
    evidence: Array

    @property
    def best(self) -> Scored:
        """The most likely model, also among those with heat of unknown cause."""
        return max(self.models, key=lambda m: m.evidence)

    def instead(self, one: Scored) -> Scored:
        """The most likely model with as many effects as one that was tried, over all widths of the priors."""
        level = np.median(self.evidence, axis=1)
        alike = [
            k for k, m in enumerate(self.models) if len(m.hypotheses) == len(one.hypotheses) and not m.forced
        ]
        return self.models[max(alike, key=lambda k: level[k])] if alike else one

    @property
    def shares(self) -> Array:
        """(M,) share of each model among those that were tried."""
        return np.asarray(np.exp(self.evidence - log_sum_exp(self.evidence)[None, :]).mean(axis=1))

    def of(self, holds: Callable[[Scored], bool]) -> float:
        """Probability of a statement about the machine."""
        true = np.array([holds(m) for m in self.models])
        if true.all() or not true.any():
            return float(true.all())
        odds = self.evidence[true].max(axis=0) - self.evidence[~true].max(axis=0)
        return float(np.mean(1.0 / (1.0 + np.exp(-np.clip(odds, -500, 500)))))

    def of_claims(self, several: Iterable[Hypothesis]) -> float:
        """Probability that one of several effects acts at any place, from the inputs that it follows, in the
        recordings of its hypothesis.
        """
        claims = {(h.effect.word, h.follows, h.event) for h in several}
        return self.of(lambda m: any((o.effect.word, o.follows, o.event) in claims for o in m.hypotheses))

    @property
    def nothing(self) -> float:
        """Probability that the model lacks nothing."""
        return self.of(lambda m: not m.hypotheses and not m.forced)


def posterior(context: Context, models: Collection[Scored], seed: int = 0) -> Posterior:
    """The posterior of models over bootstrap draws of blocks, prior widths integrated out."""
    best = max(m.evidence for m in models)
    taking = sorted((m for m in models if m.evidence > best - FAR), key=lambda m: -m.evidence)[:MOST]
    draws = _draws(len(context.recordings), context.blocks, seed)
    return Posterior(tuple(taking), np.array(side_by_side(lambda m: _evidence(m, draws), taking)))


def _draws(recordings: int, blocks: int, seed: int) -> Array:
    """Count of each block (D, B) in each draw, with the same number of blocks in each recording."""
    rng = np.random.default_rng(seed)
    count = thresholds.DRAWS
    one = [rng.multinomial(blocks, np.full(blocks, 1 / blocks), count) for _ in range(recordings)]
    return np.concatenate(one, axis=1).astype(float)


def _evidence(model: Scored, draws: Array) -> Array:
    """Log evidence (D,) of a model on each draw, over noise settings and prior widths.

    A block that is drawn twice brings its noise twice, and a model fits more of it, the more unknowns it has:
    a usual draw is too high by half of their effective number. Draws only say how far evidence varies, about
    what it is with each block once.
    """
    order = np.argsort(-model.levels)[:SETTINGS]
    near = [int(k) for k in order if model.levels[k] > model.levels[order[0]] - IN_PLAY]
    each_once = np.ones((1, draws.shape[1]))
    weights = np.concatenate([each_once, draws])
    pieces = np.concatenate([model.drawn(k, weights, WIDTHS) for k in near])
    level = log_sum_exp(pieces) - float(np.log(len(WIDTHS))) + model.prior
    return np.asarray(level[0] + level[1:] - np.median(level[1:]))
