"""Search for the most likely set of effects, one refit at a time.

Effects are added as long as the posterior grows. Then each effect is removed, and replaced by each rival, as
a test. All refitted models are kept and take part in the posterior.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations
from math import inf

from discovery.diagnosis.context import Context
from discovery.diagnosis.refit import rescored, score
from discovery.diagnosis.scan import Scan, attempt, scan_model
from discovery.diagnosis.scored import MOVED, Scored, is_usual, light
from discovery.effects.hypothesis import Hypothesis, Key
from discovery.evidence.bayes import Score
from discovery.fitting import Noise
from discovery.fitting.solve import cost_under
from discovery.threads import side_by_side

MOST = 6  # effects at once
REFITS = 5  # claims that are refitted at each step
RIVALS = 3  # ... in the place of another one
HOPE = 4.0  # log odds below those of the model without it from which a claim is not refitted
HALF = 0.6  # of the best log odds: claims that reach it are refitted
NEAR = 10.0  # log evidence within which an effect may replace another one that it has replaced before
FAR = 40.0  # log evidence below the best from which a model is not scored again, and refits end early

Keys = frozenset[Key]


@dataclass
class Search:
    """The course of a search under one context.

    `tried`: the best refit of each set of effects; `lost`: sets that run away or press against zero;
    `scans`: of each model taken up; `first`: claims of an earlier search under another noise.
    """

    context: Context
    tell: Callable[[str], None] = lambda _: None
    tried: dict[Keys, Scored] = field(default_factory=dict)
    lost: set[Keys] = field(default_factory=set)
    scans: dict[Keys, Scan] = field(default_factory=dict)
    first: tuple[Score, ...] = ()

    @property
    def baseline(self) -> Scored:
        """The model without any effect."""
        return self.tried[frozenset()]

    @property
    def claims(self) -> tuple[Score, ...]:
        """Candidates as the first scan scored them on the residual of the baseline."""
        return self.first or self.scanned(self.baseline).claims

    @property
    def best(self) -> Scored:
        """The most likely model."""
        return max(self.tried.values(), key=lambda one: one.evidence)

    @property
    def gain(self) -> float:
        """Log posterior odds of the best model over the baseline."""
        return self.best.evidence - self.baseline.evidence

    def run(self) -> Search:
        """Search from the most likely model that was tried, or from the baseline.

        If the answer is coarse, search from each other first effect that was about as likely, too: the best
        first step need not lead furthest.
        """
        self._settled(self.grow().best)
        for first in self._as_likely():
            coarse = not is_usual(self.best.setting)
            if coarse and not first.keys <= self.best.keys:
                self._settled(first)
        for one in (*self._by_itself(), *self._for_several()):
            if one.evidence >= self.best.evidence:
                self._settled(one)
        return self

    def _settled(self, current: Scored) -> None:
        """Add effects and question them until nothing changes."""
        while True:
            start = current.keys
            current = self._questioned(self._grown(current))
            if current.keys == start or len(current.hypotheses) >= MOST:
                return

    def _by_itself(self) -> list[Scored]:
        """Each effect of an answer of several alone: those that came before it may have stood in for it, and
        removing them one at a time does not show that none of them is needed.
        """
        answer = self.best
        alone = [(h,) for h in answer.hypotheses if len(answer.hypotheses) > 2]
        fresh = [own for own in alone if frozenset((own[0].key,)) not in self.tried]
        goal = self.goal(answer.noise) if fresh else inf
        found = side_by_side(lambda own: score(self.context, own, answer.noise, answer.fit, goal=goal), fresh)
        return [self.keep(one) for one in found if one is not None]

    def _for_several(self) -> list[Scored]:
        """What looks like an effect of an answer of several, alone: a path between two bodies may stand as a
        second mass at one of them and heat at the other. In the place of one of these it fits nothing.
        """
        answer = self.best.hypotheses
        if len(answer) < 2:
            return []
        best = self._refitted(self.baseline, (), [c for h in answer for c in look_alikes(h, self.claims)])
        return [best] if best.hypotheses else []

    def _as_likely(self) -> list[Scored]:
        """Models with a single effect that are about as likely as the best of them."""
        single = [one for one in self.tried.values() if len(one.hypotheses) == 1]
        best = max((one.evidence for one in single), default=inf)
        return sorted((one for one in single if one.evidence > best - NEAR), key=lambda one: -one.evidence)

    def grow(self) -> Search:
        """Add effects to the most likely model that was tried, or to the baseline, and question none."""
        self._grown(self.begun().best)
        return self

    def begun(self) -> Search:
        """Score the model without any effect, if nothing was tried."""
        if not self.tried:
            first = score(self.context, (), self.context.usual)
            assert first is not None  # the context has fitted it
            self.keep(first)
        return self

    def under(self, context: Context) -> Search:
        """The search under another noise: the tried models that are not far below the best, scored again. The
        best and the one without effects come first: fits of the others end where they cannot come near.
        """
        best, baseline = self.best, self.baseline
        other = Search(context, self.tell, first=self.claims if self.scans else ())
        for one in (best, baseline) if best is not baseline else (best,):
            other.keep(rescored(context, one))
        near = [one for one in self.tried.values() if one.evidence > best.evidence - FAR]
        near = [one for one in near if one is not best and one is not baseline]
        goal = other.goal
        for one in side_by_side(lambda one: _lighter(rescored(context, one, goal)), near):
            other.keep(one)
        return other

    def keep(self, one: Scored) -> Scored:
        """Store a refit if no refit of the same effects is better."""
        if one.keys not in self.tried or self.tried[one.keys].evidence < one.evidence:
            self.tried[one.keys] = _lighter(one)
        return one

    def finish(self, one: Scored) -> None:
        """Fit a model to the end whose fit ended early, as it did not look likely enough."""
        whole = score(self.context, one.hypotheses, one.noise, one.fit)
        if whole is None or whole.evidence == -inf:
            del self.tried[one.keys]
            self.lost.add(one.keys)
        else:
            self.tried[one.keys] = _lighter(whole)

    def finish_near(self, within: float) -> None:
        """Fit to the end what takes part in the answer: a fit that ended early only promises its evidence."""
        early = [one for one in self.tried.values() if one.fit.ended_early]
        for one in early:
            if one.evidence > self.best.evidence - within:
                self.finish(one)

    def scanned(self, one: Scored) -> Scan:
        """The scan of a model."""
        if one.keys not in self.scans:
            self.scans[one.keys] = scan_model(self.context, one)
        return self.scans[one.keys]

    def _grown(self, current: Scored) -> Scored:
        """Add the best candidate, or let an effect act at more places or fewer, as long as the posterior
        grows.
        """
        while len(current.hypotheses) < MOST:
            looks = (self._added, self._widened, self._narrowed, self._joined)
            ways = [look(current) for look in looks]
            best = max(ways, key=lambda one: one.evidence)
            if best.evidence <= current.evidence:
                break
            current = best
            self.tell(f"{best.hypotheses[-1].effect.title}, {best.hypotheses[-1].where}")
        return current

    def _added(self, current: Scored) -> Scored:
        """The best refit with one of the best candidates; `current` if none is better. Candidates that run
        away or press against zero give way to the next.
        """
        own, scan = current.keys, self.scanned(current)

        def left(claims: Sequence[Score]) -> list[Score]:
            return [c for c in claims if own | {c.hypothesis.key} not in self.lost]

        while True:
            quiet = left(scan.quiet)
            reached = quiet[0].odds if quiet else -inf
            pool = [
                *hopeful(left(scan.claims), REFITS),
                *hopeful(quiet, RIVALS),
                *hopeful(left(scan.quiet_events), RIVALS, reached),
                *hopeful(left(scan.inside), RIVALS),
            ]
            before, best = len(self.lost), self._refitted(current, current.hypotheses, pool)
            if len(self.lost) == before:
                return best

    def _widened(self, current: Scored) -> Scored:
        """The best refit with an effect at its places and more; `current` if none is better."""
        best = current
        for h in current.hypotheses:
            others = tuple(o for o in current.hypotheses if o.key != h.key)
            wider = [c for c in self.scanned(current).without[h.key] if c.hypothesis.widens(h)]
            best = max(best, self._refitted(current, others, wider), key=lambda one: one.evidence)
        return best

    def _narrowed(self, current: Scored) -> Scored:
        """The best refit where a law at several bodies and the same law once more at some of them become one
        at the others: what comes second may take back what the first one is too much. `current` if none is
        better.
        """
        best = current
        for h, again in permutations(current.hypotheses, 2):
            fewer = h.without(again.states) if h.widens(again) else None
            if fewer is not None:
                others = tuple(o for o in current.hypotheses if o.key not in (h.key, again.key))
                claim = _of_model(fewer, current)
                best = max(best, self._refitted(current, others, [claim]), key=lambda one: one.evidence)
        return best

    def _joined(self, current: Scored) -> Scored:
        """The best refit where effects that are one law at one body each become this law at all of them, of
        one size; `current` if none is better.
        """
        best = current
        for claim in self.scanned(current).claims if len(current.hypotheses) > 1 else ():
            h = claim.hypothesis
            each = [o for o in current.hypotheses if h.widens(o)]
            bodies = {state for o in each for state in o.states}
            one = h if set(h.states) == bodies else h.without([b for b in h.states if b not in bodies])
            if len(each) > 1 and one is not None:
                others = tuple(o for o in current.hypotheses if o not in each)
                begin = replace(claim, hypothesis=one, size=_of_model(each[0], current).size)
                best = max(best, self._refitted(current, others, [begin]), key=lambda one: one.evidence)
        return best

    def _questioned(self, current: Scored) -> Scored:
        """Remove each effect, and try its rivals instead."""
        scan = self.scanned(current) if current.hypotheses else None
        for h in current.hypotheses if scan else ():
            others = tuple(o for o in current.hypotheses if o.key != h.key)
            without = self._from(current, others)
            if scan is None or without is None:
                continue
            own = current.evidence - without.evidence
            # an infinite gain: what is left has a size of the wrong sign, so that nothing is reached
            reached = own if own < inf else -inf
            pool = hopeful(scan.without[h.key], RIVALS, reached)
            pool = [*pool, *look_alikes(h, scan.without[h.key]), *self._in_its_place(h, current)]
            best = self._refitted(without, others, pool)
            if max(best.evidence, without.evidence) > current.evidence:
                return self._questioned(max(best, without, key=lambda a: a.evidence))
        return current

    def _from(self, current: Scored, fewer: Sequence[Hypothesis]) -> Scored | None:
        """The model with fewer effects, fitted from where another one stands; None if it does not stay
        finite. If it is known, its fit may have ended in a minimum that the other one has left.
        """
        keys, noise = frozenset(h.key for h in fewer), current.noise
        known = self.tried.get(keys)
        goal = self.goal(noise)
        if known is not None:
            fit = known.fit
            goal = min(goal, cost_under(fit.problem, fit.theta, fit.trajectories, noise) - MOVED)
        found = score(self.context, fewer, noise, current.fit, goal=goal)
        if found is not None:
            self.keep(found)
        return self.tried.get(keys)

    def _in_its_place(self, h: Hypothesis, current: Scored) -> list[Score]:
        """Effects that stood in the place of an effect of a model, next to fewer others, and were about as
        likely. The scan sees a large effect only to first order; these were refitted.
        """
        found = {}
        for keys, one in self.tried.items():
            others = keys & (current.keys - {h.key})
            other = self.tried.get(others | {h.key})
            if other is None or len(keys) != len(others) + 1 or keys <= current.keys:
                continue
            if one.fit.ended_early or other.fit.ended_early:  # how likely they are was not found out
                continue
            if other.evidence - one.evidence < NEAR:
                rival = next(o for o in one.hypotheses if o.key not in others)
                found[rival.key] = _of_model(rival, one)
        return list(found.values())

    def _refitted(self, start: Scored, others: Sequence[Hypothesis], pool: Sequence[Score]) -> Scored:
        """The best refit with one of some candidates added; `start` if none is better."""
        own, pool = [o.key for o in others], not_twice(pool, others)
        keys = [frozenset((*own, claim.hypothesis.key)) for claim in pool]
        known = {*self.tried, *self.lost}
        # an effect may have several formulas at a place, and an event other instants under other noise
        fresh = {
            (key, claim.hypothesis.amplitudes, _instants(claim.hypothesis)): claim
            for key, claim in zip(keys, pool, strict=True)
            if key not in known
        }

        least = start.evidence - NEAR

        def tried(claim: Score) -> Scored | None:
            one = attempt(self.context, start, others, claim, self.goal, least)
            return light(one) if one is not None and one.evidence > -inf else None

        for one in side_by_side(tried, list(fresh.values())):
            if one is not None:
                self.keep(one)
        self.lost |= {key for key, *_ in fresh if key not in self.tried}
        while True:
            among = [self.tried[key] for key in keys if key in self.tried]
            best = max([start, *among], key=lambda one: one.evidence)
            if best is start or not best.fit.ended_early:
                return best
            self.finish(best)

    def goal(self, noise: Noise, below: float = 0.0) -> float:
        """Cost of a fit from which it can be part of the answer, or `below` it in log evidence."""
        best = self.best.fit
        return FAR + below + cost_under(best.problem, best.theta, best.trajectories, noise)


def _instants(h: Hypothesis) -> tuple[float, ...]:
    return tuple(h.shapes[name] for name in h.instants)


def _of_model(h: Hypothesis, one: Scored) -> Score:
    """A claim to be refitted, which no scan has scored, with the sizes that a model has."""
    values = one.fit.model.parameters
    return Score(h, 0.0, 0.0, tuple(values[name].value for name in h.amplitudes), 1.0, 0)


def _lighter(one: Scored) -> Scored:
    """Without what takes memory; the baseline is asked for it again."""
    return light(one) if one.hypotheses else one


def look_alikes(h: Hypothesis, claims: Sequence[Score]) -> list[Score]:
    """The best candidate of the same effect elsewhere, and of each effect that looks the same, whatever their
    odds in a scan: to first order it shows neither which is better nor that a large effect is there at all.
    """
    words = (h.effect.word, *h.effect.confused_with)
    found = [next((c for c in claims if c.hypothesis.effect.word == word), None) for word in words]
    return [c for c in found if c is not None]


def not_twice(claims: Sequence[Score], others: Sequence[Hypothesis]) -> list[Score]:
    """Candidates that share no size with other effects. A jet that moves from body a to b, and one that moves
    from b to c, have the same size at b: a model cannot hold both.
    """
    sizes = {name for other in others for name in other.amplitudes}
    return [c for c in claims if sizes.isdisjoint(c.hypothesis.amplitudes)]


def hopeful(claims: Sequence[Score], most: int, reached: float = -inf) -> list[Score]:
    """Candidates that are worth a refit: the scan sees a large effect only to first order."""
    best = max([reached, *(c.odds for c in claims[:1])])
    return [c for c in claims[:most] if c.odds > max(-HOPE, HALF * best - HOPE)]
