"""What speaks against an answer as a whole: events that are none, something left, a machine too far away."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.forcing import Forcing
from discovery.mismatch.gates import bent, objections, unseen_lag
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.question import BLUNT, NAMED, SMALL, echoes, recurs, trace
from discovery.mismatch.search import MOST, Search

FREE = 9.0  # log evidence of free heat beyond which something acts, named or not
MUCH = 3.0  # times the reading noise: a machine that leaves so much in no pattern is not well modelled


def doubts(
    context: Context, found: Search, before: Sequence[Forcing], after: Sequence[Forcing]
) -> tuple[str, ...]:
    """Sentences that forbid to name what was found; empty where all its effects may be named.

    Args:
        before, after: free forcing on what the baseline and the best model leave.
    """
    return (*_no_events(context, found), *_not_all(context, found, before, after))


def _no_events(context: Context, found: Search) -> Iterator[str]:
    """Sentences that forbid to call something an event, or a late clock."""
    chosen = found.best.hypotheses
    if recurs(context, chosen):
        yield "unrecorded events come again and again: a cause, not an event"
    for where in dict.fromkeys(h.where for h in chosen if echoes(h, found.looks[-1])):
        yield f"unrecorded heat at {where} shows in another recording, too: a cause, not an event"
    heated = any(h.recording and h.effect.word == "unmeasured_heat" for h in chosen)
    if len(context.recordings) == 1 and heated:
        yield (
            "in the only recording an event cannot be told from what a law slightly off in form leaves; "
            "a second recording to fit would tell"
        )
    late = {h.recording for h in chosen if h.effect.word == "clock_shift"}
    if late >= set(context.recordings):
        yield (
            "every recording would need its clock shifted: that may as well be a dead time between what "
            "drives the machine and what is read"
        )


def _not_all(
    context: Context, found: Search, before: Sequence[Forcing], after: Sequence[Forcing]
) -> Iterator[str]:
    """Sentences that forbid to name what was found: more is missing, or the form is wrong."""
    best = found.best
    if len(best.hypotheses) >= MOST and best.rms() > MUCH:
        yield (
            f"{len(best.hypotheses)} effects leave {best.rms():.1f} times the reading noise: the model is "
            "too far from this machine to say what is missing"
        )
    if other := _left(context, found):
        yield f"{other.effect.word} at {other.where} is still significant after the repair"
    if after and after[0].gain > max(FREE, 0.1 * found.gain):
        yield f"free heat at {after[0].state} still explains much after the repair"
    if before and found.gain < 0.5 * before[0].gain:
        yield "free heat explains more than twice what the best effect does"
    for h in best.hypotheses:
        yield from objections(best, h, found.gain)


def _left(context: Context, found: Search) -> Hypothesis | None:
    """What is still significant beside the best model, if anything.

    By the bars of the search: what would be bent to its limit has to add more, and so has what may be the
    trace of a law slightly off in form. Where something was dropped because it did not carry over, the search
    had found nothing more beside it.
    """
    if found.dropped:
        return None
    significant = []
    for c in found.looks[-1]:
        h = c.hypothesis
        usual = context.minor(h)[0] <= abs(c.size[0]) <= h.effect.amplitude.most
        if not usual or unseen_lag(context, h):
            continue
        refit = _beside(found, h)
        more = refit.evidence - found.best.evidence if refit else c.gain
        bar = max(NAMED + trace(found.gain + more), 0.05 * found.gain)
        if refit and any(bent(refit, o) for o in refit.hypotheses if o.key == h.key):
            bar = max(bar, BLUNT, SMALL * found.gain)  # with less it would be dropped, were it in the model
        if abs(c.size[0]) < context.half_a_link(h)[0]:
            bar = max(bar, BLUNT)
        if echoes(h, found.looks[-1]):
            bar = max(bar, SMALL * found.gain)
        if more > bar:
            significant.append((more, h))
    return max(significant, key=lambda item: item[0])[1] if significant else None


def _beside(found: Search, h: Hypothesis) -> Assessment | None:
    """The best refit of a claim beside the best model, where it was tried."""
    keys = {o.key for o in found.best.hypotheses} | {h.key}
    refits = [a for a in found.tried if {o.key for o in a.hypotheses} == keys]
    return max(refits, key=lambda a: a.evidence, default=None)
