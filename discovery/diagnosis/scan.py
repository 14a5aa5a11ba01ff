"""The scan: every effect at every place, scored on the residual of a model to first order."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.refit import ENOUGH, LONGEST, score
from discovery.diagnosis.scored import Scored, is_usual, whitened
from discovery.effects.candidates import with_shapes
from discovery.effects.hypothesis import Hypothesis, Key
from discovery.errors import RunsAwayError
from discovery.evidence.bayes import Score, Without, scan
from discovery.evidence.events import place_events
from discovery.evidence.settings import AXES, Setting
from discovery.evidence.signatures import signatures
from discovery.evidence.whitening import Whitened
from discovery.fitting import Noise
from discovery.fitting.problem import Unknown
from discovery.fitting.solve import solve


@dataclass(frozen=True)
class Scan:
    """Candidates scored on the residual of a model, best odds first, and on that without one effect.

    `quiet`: as if there were little process noise and no form error, where the most likely ones are larger:
    they may have absorbed the missing physics, and leave nothing to any candidate. `quiet_events`: events at
    the instants that are most likely then. `inside`: as `quiet`, with parameters that press against a bound
    where their author believes them.
    """

    claims: tuple[Score, ...]
    without: Mapping[Key, tuple[Score, ...]]
    quiet: tuple[Score, ...] = ()
    quiet_events: tuple[Score, ...] = ()
    inside: tuple[Score, ...] = ()


def scan_model(context: Context, current: Scored) -> Scan:
    """Score every effect at every place on the residual of a model."""
    offered = [h for h in context.candidates if h.key not in current.keys]
    offered = [h for h in offered if h.effect.search != "single readings"]
    settings = in_play(context, current)
    events = [h for h in offered if h.effect.search in ("window", "step")]
    slabs = [context.slab([h]) for h in events]
    placed, *quiet = place_events(current.seen, settings, events, slabs)
    there = [_at_instants(h, o) for o in current.hypotheses if o.spans for h in events if _alike(h, o)]
    moved = [one for h in there for one in with_shapes(h)]
    lasting = [one for h in offered if h.effect.search == "shapes" for one in with_shapes(h)]
    every = [*lasting, *placed, *moved]
    own = [_without(current, h) for h in current.hypotheses]
    found = scan(current.seen, settings, every, context.slab(every), own)
    by_effect = zip(current.hypotheses, found.without, strict=True)
    within = inside(context, current)
    return Scan(
        tuple(found.claims),
        {h.key: tuple(claims) for h, claims in by_effect},
        tuple(found.quiet) if len(settings) > 1 else (),
        tuple(scan(current.seen, settings[-1:], quiet[0], context.slab(quiet[0])).claims) if quiet else (),
        tuple(scan(within, settings[-1:], every, context.slab(every)).claims) if within else (),
    )


def inside(context: Context, current: Scored) -> Whitened | None:
    """A model with each parameter that presses against a bound held where its author believes it, the others
    fitted; None where none presses. Where nothing is found yet and the flows are wrong by more than usual, so
    is each parameter that is far from there.

    A body that lacks heat fits best without any loss: it is cut off, and heat alone fits it no better. To
    first order only a body that is alive shows that both are missing.
    """
    problem = current.fit.problem
    begins = not current.hypotheses and not is_usual(current.setting)
    far = thresholds.MISSED if begins else inf
    held = {
        k: u.start
        for k, u in enumerate(problem.unknowns)
        if not u.is_nuisance
        and u.low < u.start < u.high
        and (k not in current.seen.moving or _from_belief(u, float(current.fit.theta[k])) > far)
    }
    if not held:
        return None
    unknowns = [
        replace(u, low=held[k], high=held[k]) if k in held else u for k, u in enumerate(problem.unknowns)
    ]
    theta = np.array([held.get(k, x) for k, x in enumerate(current.fit.theta)])
    try:
        found = solve(
            replace(problem, unknowns=tuple(unknowns)), theta, context.usual, "linear", LONGEST, ENOUGH
        )
    except RunsAwayError:
        return None
    fit = replace(current.fit, theta=found.theta, trajectories=found.trajectories)
    return whitened(context, current.hypotheses, fit)


def _from_belief(unknown: Unknown, value: float) -> float:
    """How many widths of what its author believes a parameter lies from there."""
    if unknown.belief is None:
        return 0.0
    return abs(float(np.log(value / unknown.start))) / unknown.belief if value > 0 else inf


def _alike(h: Hypothesis, other: Hypothesis) -> bool:
    """Whether two events of one recording have as many instants."""
    return h.recording == other.recording and h.effect.search == other.effect.search


def _at_instants(h: Hypothesis, other: Hypothesis) -> Hypothesis:
    """An event at the instants of another one."""
    names = list(zip(h.instants, other.instants, strict=True))
    spans = {mine: other.spans[its] for mine, its in names if its in other.spans}
    return replace(h.at({mine: other.shapes[its] for mine, its in names}, other.log_weight), spans=spans)


def _without(current: Scored, h: Hypothesis) -> Without:
    """The contribution of one effect of a model, to be removed, and its unknowns."""
    fitted = current.fit.model.parameters
    sizes = {name: fitted[name].value for name in (*h.amplitudes, *h.shapes)}
    here = replace(h, shapes={name: sizes[name] for name in h.shapes})
    amounts = np.array([sizes[name] for name in h.amplitudes])
    shown = tuple(signatures(t, [here]) @ amounts for t in current.fit.trajectories)
    names = {*h.amplitudes, *h.shapes}
    unknowns = current.fit.problem.unknowns
    mine = [k for k, i in enumerate(current.seen.moving) if unknowns[i].name in names]
    return Without(shown, np.array(mine, dtype=np.intp))


def in_play(context: Context, current: Scored) -> list[Setting]:
    """Noise settings for the scan: the most likely one, and one with little process noise and no form error,
    because these may have absorbed the missing physics.
    """
    best = current.setting
    kept = best.place[: AXES.index("share")]
    other = context.settings.at((*kept, *(0 for _ in best.place[len(kept) :])))
    return [best] if other.place == best.place else [best, other]


def attempt(
    context: Context,
    current: Scored,
    others: Sequence[Hypothesis],
    claim: Score,
    goal: Callable[[Noise], float] = lambda _: inf,
    least: float = -inf,
) -> Scored | None:
    """Refit with a further candidate, starting from the sizes of the scan.

    Args:
        goal: as in `fit_model`, under a noise.
        least: as in `scored`.
    """
    h = claim.hypothesis
    sizes: dict[str, float] = {}
    if h.effect.amplitude.fixed is None:
        low, _ = h.effect.amplitude.ends
        sizes = {n: max(s, low) for n, s in zip(h.amplitudes, claim.size, strict=True)}
    chosen = (*others, h)
    noises = _noises(context, current)
    tries = [score(context, chosen, noise, current.fit, sizes, goal(noise), least) for noise in noises]
    found = [one for one in tries if one is not None]
    return max(found, key=lambda one: one.evidence, default=None)


def _noises(context: Context, current: Scored) -> list[Noise]:
    """Noises to refit under: the most likely one, and the usual one where that is larger than usual, because
    much process noise explains any path of a model and holds a fit where it is.
    """
    coarse = not is_usual(current.setting)
    return [current.noise, context.usual] if coarse else [current.noise]
