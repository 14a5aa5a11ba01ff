"""A scored model: a set of effects added, everything refitted, and its log marginal likelihood."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.left_open import Known
from discovery.diagnosis.uphill import goes_uphill
from discovery.diagnosis.walk import Node, walked
from discovery.effects.hypothesis import Hypothesis, Key
from discovery.evidence.bayes import Slab
from discovery.evidence.form_error import effect_form
from discovery.evidence.process_noise import (
    UnknownChange,
    UnknownHeat,
    neighbours,
    unknown_change,
    unknown_heat,
)
from discovery.evidence.settings import Setting
from discovery.evidence.whitening import Grams, Whitened, log_sum_exp, moving
from discovery.fitting import Fit, Noise
from discovery.fitting.covariance import Z95
from discovery.models import Model
from discovery.threads import side_by_side

Array = NDArray[np.float64]

_ERRORS = slice(2, 6)  # of the place of a setting: slow noise, unrecorded heat, errors of flows and of laws
MOVED = 1.0  # log-likelihood that calls for another look
# what something of unknown cause changes of a score
_OF_FORCE = ("settings", "grams", "forced", "forced_state", "log_odds_force")


@dataclass(frozen=True)
class Scored:
    """A fitted model with a set of effects, and its log marginal likelihood.

    `settings` are those that were tried, `grams` under each; `sizes` (A,) index of each free amplitude among
    the unknowns that move, -1 for one that presses against zero.
    """

    hypotheses: tuple[Hypothesis, ...]
    fit: Fit
    seen: Whitened
    settings: tuple[Setting, ...]
    grams: tuple[Grams, ...]
    slab: Slab
    sizes: NDArray[np.intp]
    at: Array  # (A,) the amplitudes where the fit stands
    outside: bool = False  # at the end of the range of a shape, or heat goes uphill: another law acts
    forced: str = ""  # what of unknown cause acts, too
    forced_state: str = ""  # the state that it heats
    log_odds_force: float = 0.0
    unmet: float = 0.0  # log evidence that a step from the fit promises, and refits did not find

    @property
    def keys(self) -> frozenset[Key]:
        """What it claims."""
        return frozenset(h.key for h in self.hypotheses)

    @cached_property
    def model(self) -> Model:
        """The fitted model, with intervals."""
        return self.fit.model

    @property
    def acts(self) -> bool:
        """Whether its effects act: one that presses against zero does not, and at the end of the range of its
        shape, or where it takes heat from cold to warm, another law does.
        """
        return not self.outside and not (self.sizes < 0).any()

    @property
    def prior(self) -> float:
        """Log prior odds of its effects, of the instants of its events, and of a latent force."""
        unknown = self.log_odds_force if self.forced else 0.0
        return sum(h.log_odds + (h.log_weight if h.spans else 0.0) for h in self.hypotheses) + unknown

    @cached_property
    def levels(self) -> Array:
        """(S,) log marginal likelihood under each noise setting that was tried, its weight included."""
        return np.array([self.level(k) for k in range(len(self.grams))])

    @cached_property
    def evidence(self) -> float:
        """Log marginal likelihood with everything integrated out, plus the prior odds of what acts."""
        return float(log_sum_exp(self.levels)) + self.prior

    @cached_property
    def best(self) -> int:
        """The noise setting that is most likely, among those that were tried."""
        return int(np.argmax(self.levels))

    @property
    def setting(self) -> Setting:
        """The noise setting that is most likely."""
        return self.settings[self.best]

    @property
    def noise(self) -> Noise:
        """The noise that is most likely."""
        return self.setting.noise

    @property
    def coarse(self) -> bool:
        """Whether its laws and flows are off by more than is usual for a lumped model, under the most likely
        noise. Heat that nobody records does not follow its flows: it says nothing of them.
        """
        return is_large(self.off)

    @property
    def ahead(self) -> float:
        """Log-likelihood by which the optimum under the most likely noise lies above the fit, to first order.

        A fit knows no form errors, so none take part.
        """
        return self.grams[self.best].without(self.seen.spread).ahead

    @property
    def reached(self) -> float:
        """Log marginal likelihood without what a step from the fit only promises."""
        return self.evidence - self.ahead if self.evidence > -inf else -inf

    @property
    def off(self) -> float:
        """Share of the flows by which the model is wrong under the most likely noise."""
        return _off_by(self.setting)

    @property
    def unrecorded(self) -> float:
        """Heat that nobody records under the most likely noise, as a share of what flows."""
        return _unrecorded(self.setting)

    def level(self, k: int) -> float:
        """Log marginal likelihood under one noise setting."""
        return float(self.drawn(k)[0, 0])

    def _forms(self, k: int) -> tuple[Grams, ...]:
        """Without and with form errors of the effects."""
        spread = self._own_forms
        return (self.grams[k].without(spread), self.grams[k]) if len(spread) else (self.grams[k],)

    @property
    def _own_forms(self) -> Array:
        """Spreads of the form errors of the effects: each law is wrong by a share that depends on the
        operating point.
        """
        return self.seen.spread[sum(self.seen.form) :]

    def drawn(self, k: int, weights: Array | None = None, widths: Sequence[float] = (1.0,)) -> Array:
        """(W, D) `level` under a noise setting for many draws at once; arguments as in `Grams.marginal`."""
        finite = np.isfinite(self.grams[k].rows.logdet).all()  # under this noise, too
        if not self.acts or not finite:
            return np.full((len(widths), 1 if weights is None else len(weights)), -inf)
        forms = self.grams[k].marginals(self.sizes, self._own_forms, weights, widths)
        level, step, covariance = (np.array(one) for one in zip(*forms, strict=True))
        count = len(self.sizes)
        if count:
            mean, variance = self.at + step, np.diagonal(covariance, 0, -2, -1)
            every = self.slab.take(np.tile(np.arange(count), level.size))
            sizes = every.average(mean.ravel(), variance.ravel()).reshape(mean.shape)
            level = level + sizes.sum(axis=-1) + 0.5 * count * float(np.log(2 * np.pi))
        return log_sum_exp(level) + self.settings[k].log_weight - float(np.log(len(forms))) - self.unmet

    def beyond(self) -> tuple[float, float]:
        """Log-likelihood at the optimum under the most likely noise, form errors of the model integrated out,
        and by how much it lies above the unknowns of the fit, to first order.
        """
        gram = self._forms(self.best)[0]
        return gram.solved()[0], gram.ahead

    def stepped(self, part: float) -> Array:
        """The unknowns of the fit after a part of the step to that optimum, within their bounds."""
        _, step, _ = self._forms(self.best)[0].solved()
        theta = np.array(self.fit.theta)
        for k, i in enumerate(self.seen.moving):
            unknown, move = self.fit.problem.unknowns[i], part * float(step[k])
            at = theta[i]
            theta[i] = at * np.exp(np.clip(move / at, -5, 5)) if unknown.is_log else at + move
            theta[i] = min(max(theta[i], unknown.low), unknown.high)
        return theta

    def interval(self, name: str) -> tuple[float, float] | None:
        """The 95 % interval of a parameter under the most likely noise; None where it is at a bound."""
        unknowns = self.fit.problem.unknowns
        index = next((i for i, u in enumerate(unknowns) if u.name == name and not u.is_nuisance), -1)
        place = np.flatnonzero(self.seen.moving == index)
        if not len(place):
            return None
        _, step, covariance = self._forms(self.best)[0].solved()
        if self.beyond()[1] >= MOVED:
            step = np.zeros_like(step)  # where a linear look reaches too far (`centred.py`)
        k, unknown = int(place[0]), unknowns[index]
        at, half = float(self.fit.theta[index]), Z95 * float(np.sqrt(covariance[k, k]))
        if unknown.is_log:  # a time constant is known within a factor
            logs = np.clip([(step[k] + side * half) / at for side in (-1.0, 1.0)], -500, 500)
            ends = [float(end) for end in at * np.exp(logs)]
        else:
            ends = [at + step[k] + side * half for side in (-1.0, 1.0)]
        return max(ends[0], unknown.low), min(ends[1], unknown.high)

    def known(self) -> Known:
        """How well the recordings determine the parameters, under the most likely noise."""
        unknowns = [self.fit.problem.unknowns[i] for i in self.seen.moving]
        shared = [k for k, u in enumerate(unknowns) if not u.is_nuisance and u.recording is None]
        _, _, covariance = self._forms(self.best)[0].solved()
        late: dict[str, list[float]] = {}
        for k, u in enumerate(unknowns):
            if u.is_late:
                square = float(self.fit.theta[self.seen.moving[k]] ** 2 + covariance[k, k])
                late.setdefault(u.name, []).append(square)
        return Known(
            tuple(unknowns[k].name for k in shared),
            covariance[np.ix_(shared, shared)],
            {name: float(np.sqrt(np.mean(squares))) for name, squares in late.items()},
        )

    def rms(self, apart: Collection[str] = ()) -> float:
        """Root mean square of the residuals over their reading noise, without some recordings."""
        white = np.array(self.grams[0].noise.white)
        runs = [t.system.grid.recording for t in self.fit.trajectories]
        parts = zip(runs, self.seen.residuals, strict=True)
        z = np.concatenate([(r / white).ravel() for run, r in parts if run not in apart])
        return float(np.sqrt(np.nanmean(z**2)))


def whitened(context: Context, chosen: Sequence[Hypothesis], fit: Fit) -> Whitened:
    """A fit with a set of effects, with the form errors of the model and of the effects."""
    own = effect_form(fit.trajectories, chosen)
    form = context.form_of(chosen)
    extra = tuple(np.concatenate(parts, axis=2) for parts in zip(form.columns, own, strict=True))
    spreads = 1.0, 1.0, thresholds.AIR, thresholds.LAYERS, thresholds.FORM
    spread = np.repeat(spreads, [*form.kinds, own[0].shape[2]])
    return Whitened(fit, context.blocks, extra, spread, form.kinds)


def scored(context: Context, chosen: Sequence[Hypothesis], fit: Fit, least: float = -inf) -> Scored:
    """The score of a fit with a set of effects.

    Args:
        least: log evidence below which its most likely noise says enough.
    """
    seen = whitened(context, chosen, fit)
    free = [h for h in chosen if h.effect.amplitude.fixed is None]
    place = {u.name: i for i, u in enumerate(fit.problem.unknowns) if not u.is_nuisance}
    index = np.array([place[name] for h in free for name in h.amplitudes], dtype=np.intp)
    moves = {int(i): k for k, i in enumerate(seen.moving)}
    bare = Scored(
        tuple(chosen),
        fit,
        seen,
        (),
        (),
        context.slab(free) if free else Slab(np.zeros(0), np.zeros(0), np.zeros(0)),
        np.array([moves.get(int(i), -1) for i in index], dtype=np.intp),
        fit.theta[index],
        bool(shapes_at_end(chosen, fit)) or goes_uphill(chosen, fit),
    )
    # a fit that ended early is no part of the answer: its most likely noise says enough
    return _over_noise(context, bare, goal=inf if fit.ended_early else least)


def shapes_at_end(chosen: Sequence[Hypothesis], fit: Fit) -> list[str]:
    """Shape parameters of effects that a fit takes to the end of their range, where another law acts."""
    inside, found = {fit.problem.unknowns[i].name for i in moving(fit)}, fit.model.parameters
    shapes = [pair for h in chosen for pair in zip(h.shapes, h.effect.shapes, strict=True)]
    at_end = [(name, shape) for name, shape in shapes if not shape.instant and name not in inside]
    return [n for n, shape in at_end if not shape.or_at_once or found[n].value > shape.ends[0]]


def under_noise_of(context: Context, one: Scored) -> Scored:
    """The score of the same fit over the noise settings of another context."""
    return _over_noise(context, one)


def _over_noise(
    context: Context,
    bare: Scored,
    forces: Sequence[UnknownHeat | UnknownChange] = (),
    goal: float = -inf,
) -> Scored:
    """The score over the noise settings that matter, from the one of the fit on. A node is the place of a
    setting, and which of what something of unknown cause may be like.

    Args:
        forces: what something of unknown cause may be like; all of it is integrated over, too.
        goal: log evidence from which the score matters: below it, the most likely setting says enough.
    """
    grid, other_forces = context.settings, neighbours([f.place for f in forces])

    def allowed(setting: Setting) -> bool:
        # a force on top of form error that is larger than usual would be the same noise once more
        return not forces or is_usual(setting)

    def near(less: bool, node: Node) -> list[Node]:
        *place, j = node
        there = [(*place, other) for other in other_forces[j]] if forces else []
        here = [o for o in grid.near(tuple(place)) if not less or o[_ERRORS] < node[_ERRORS]]
        return [*((*o, j) for o in here if allowed(grid.at(o))), *there]

    def tried(node: Node) -> Scored:
        setting = grid.at(node[:-1])
        setting = forces[node[-1]].on_top_of(setting) if forces else setting
        return replace(bare, settings=(setting,), grams=(bare.seen.grams(setting.noise),))

    begin = bare.noise if bare.settings else bare.fit.noise
    # something of unknown cause leaves less to what is always there: if that does not reach the goal, the
    # other neighbours are not asked
    rounds = (True, False) if forces else (False,)
    ways = [partial(near, less) for less in rounds if bare.acts]  # what does not act is so under every noise
    first = grid.closest(begin, allowed)
    # all other models begin with the noise of one that has been there
    others = grid.at_other_times(first) if not (bare.hypotheses or forces) else []
    kept = walked([(*one, 0) for one in (first, *others)], ways, tried, goal)
    return replace(
        bare,
        settings=tuple(one.settings[0] for one in kept),
        grams=tuple(one.grams[0] for one in kept),
    )


def is_usual(setting: Setting) -> bool:
    """Whether process noise is no larger than usual, whatever it is: more may have absorbed an effect."""
    return not is_large(max(_off_by(setting), _unrecorded(setting)))


def is_large(share: float) -> bool:
    """Whether a share of what flows is more than a usual lumped model is off by."""
    return share > thresholds.SHARE


def _off_by(setting: Setting) -> float:
    """Share of the flows by which a model is wrong: its laws, or its flows."""
    own = (share for _, share in (setting.noise.force or {}).values())
    return max(setting.noise.share, setting.noise.form, *own)


def _unrecorded(setting: Setting) -> float:
    """Heat that nobody records, as a share of what flows, where there is most."""
    return max(setting.level, *setting.levels.values(), 0.0) * thresholds.FLOOR


def with_force(context: Context, one: Scored, state: str, goal: float = -inf) -> Scored:
    """The same fit with heat of unknown cause at a state, of any size; `goal`: the log evidence from which it
    matters.
    """
    forces = unknown_heat(state, context.floor[state], thresholds.UNKNOWN_HEAT, thresholds.UNKNOWN_SHARES)
    named = replace(one, forced=f"heat of unknown cause at {state}", forced_state=state)
    return _over_noise(context, replace(named, log_odds_force=_odds_of_force(context)), forces, goal)


def with_change(context: Context, one: Scored, output: str, goal: float = -inf) -> Scored:
    """The same fit with a slow change of an output, of unknown cause and any size that noise may have; `goal`
    as in `with_force`.
    """
    changes = unknown_change(output, [size for size in thresholds.SLOW if size > 1.0])
    named = replace(one, forced=f"a slow change of {output} of unknown cause")
    return _over_noise(context, replace(named, log_odds_force=_odds_of_force(context)), changes, goal)


def with_unknown(context: Context, models: Sequence[Scored], goal: float) -> list[Scored]:
    """Each model with something of unknown cause, at each state and in each output in turn; `goal` as in
    `with_force`.
    """

    def acting(task: tuple[Scored, str, bool]) -> dict[str, Any]:
        one, where, heats = task
        forced = (with_force if heats else with_change)(context, one, where, goal)
        return {name: getattr(forced, name) for name in _OF_FORCE}  # the rest is as in the model without it

    places = [*((name, True) for name in context.floor), *((name, False) for name in context.outputs)]
    tasks = [(one, *place) for one in models for place in places]
    found = side_by_side(acting, tasks)
    return [replace(one, **what) for (one, _, _), what in zip(tasks, found, strict=True)]


def _odds_of_force(context: Context) -> float:
    """Log prior odds of something of unknown cause, shared by the states and outputs."""
    return float(np.log(thresholds.ODDS) - np.log(len(context.floor) + len(context.outputs)))


def light(one: Scored) -> Scored:
    """The score without its sensitivities, which take memory and are not needed again, and of long recordings
    with what is needed of their readings.
    """
    rows = {id(gram.rows): gram.rows for gram in one.grams}
    kept = {key: each.lighter() for key, each in rows.items()}
    grams = tuple(replace(gram, rows=kept[id(gram.rows)]) for gram in one.grams)
    return replace(one, seen=replace(one.seen, last={}), grams=grams)
