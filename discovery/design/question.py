"""What to do next: which experiment decides, where to look, or what these recordings would have shown."""

from __future__ import annotations

from collections.abc import Sequence

from discovery.design.next_experiment import Aim, believed, next_experiment
from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from discovery.diagnosis.thresholds import RIVAL
from discovery.diagnosis.verdict import FAULT, NO_MISMATCH, UNEXPLAINED, Verdict
from discovery.diagnosis.when import in_words, instants
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import Score
from discovery.models import Model
from discovery.printed import sized

SAID = 2  # events to look at
INVISIBLE = 0.05  # share of a signature that a refit leaves; below it these recordings decide nothing

NOTHING_CLOSE = (
    "look at what happened in the windows with missing heat, and record what is not recorded yet at that "
    "body: its temperature, and everything else that heats or cools it"
)

READ = (
    "add {channels} to the `outputs` of the experiment and diagnose again: what is measured at bodies tells "
    "apart what these outputs alone cannot"
)

APART = Aim("separates the rivals", "the two answers differ there")
CONFIRM = Aim("would confirm the answer", "the model with and without it differs there")


def ask(context: Context, found: Search, verdict: Verdict) -> str:
    """A sentence: the experiment that would decide, where to look, or what would have been seen."""
    if verdict.word == NO_MISMATCH:
        return _smallest(found)
    if verdict.word == FAULT:
        return check_the_device(context, [n.hypothesis for n in verdict.named])
    if verdict.word == UNEXPLAINED and context.unused_readings:
        return READ.format(channels=" and ".join(context.unused_readings))
    shown = verdict.named or verdict.candidates
    first = _not_used(context) if verdict.word == UNEXPLAINED else ""
    if not shown:
        return f"{first}{NOTHING_CLOSE}"
    rivals = [
        r.hypothesis
        for n in shown
        for r in n.rivals
        if r.below <= RIVAL and not (r.hypothesis.recording and n.hypothesis.recording)
    ]  # no pattern separates two events of the past
    answer = verdict.answer
    rival = _rival_model(found, answer, rivals[0]) if rivals else None
    claims = [n.hypothesis for n in shown]
    if rival is None and all(h.recording for h in claims):
        return f"{first}{look_back(context, claims)}"
    purpose = aim(claims, rivals[0] if rival else None, bool(verdict.named))
    noise = answer.noise
    other = rival or _without(answer)
    return f"{first}{next_experiment(context, answer.fit.model, other, noise, purpose, believed(context))}"


def check_the_device(context: Context, named: Sequence[Hypothesis]) -> str:
    """What to do about faults. What a device shows in every recording, the machine may do: a body that is
    warmer inside than where its thermometer sits looks like a thermometer that is slow.
    """
    physics = {e.word for e in context.effects if e.is_physics}
    lasting = [h for h in named if h.recording is None]
    alike = dict.fromkeys(w for h in lasting for w in h.effect.confused_with if w in physics)
    if not alike:
        return (
            "check the device and repeat the recording; a fault of the measuring chain needs no new physics"
        )
    where = " and ".join(dict.fromkeys(h.where for h in lasting))
    return (
        f"test the device of {where} apart from the machine: what it shows in every recording may also be "
        f"the machine itself ({', '.join(alike)})"
    )


def _not_used(context: Context) -> str:
    """What is recorded already and could act: inputs that no term of the model uses."""
    unused = ", ".join(sorted(context.scene.unused & context.scene.largest.keys()))  # of those that move
    return f"give the model what is recorded and it does not use ({unused}), and compare; " if unused else ""


def aim(shown: Sequence[Hypothesis], rival: Hypothesis | None, answered: bool) -> Aim:
    """What can be asked about what was named, or, where nothing was, about what came closest.

    An event of one recording does not act in another one; only the laws found with it can be confirmed.
    """
    if answered and rival:
        return APART
    laws = _called([h for h in shown if h.recording is None])
    if answered:
        does = CONFIRM.does if all(h.recording is None for h in shown) else f"would confirm {laws}"
        return Aim(does, CONFIRM.differ)
    if rival:
        what = f"would separate the closest effects ({_called(shown)}, or {_called([rival])})"
        return Aim(what, "the two differ there")
    return Aim(f"would test the closest effect ({laws})", CONFIRM.differ)


def look_back(context: Context, events: Sequence[Hypothesis]) -> str:
    """What to do about events, which no pattern brings back: look at what happened, and wait for it again. Of
    many, which stand for a law rather, the first two are said.
    """
    every = list(dict.fromkeys(_happened(context, h) for h in events))
    first, *others = every[:SAID]
    alike = "what happened " if first.startswith("what happened ") else ""
    what = " and ".join([first, *(text.removeprefix(alike) for text in others)])
    what += f" (and {len(every) - SAID} more)" if len(every) > SAID else ""
    runs = " and ".join(dict.fromkeys(str(h.recording) for h in events))
    return f"look at {what}; repeat {runs} and see whether it comes again"


def _happened(context: Context, h: Hypothesis) -> str:
    """Heat and jumps have their hours; a loss that is another in a whole recording was changed before it."""
    if h.effect.is_physics and not instants(context.campaign, h):
        return f"what was changed at {h.where} before {h.recording}"
    return f"what happened {in_words(context.campaign, h)}"


def _called(shown: Sequence[Hypothesis]) -> str:
    return " and ".join(f"{h.effect.word} at {h.where}" for h in shown)


def _without(best: Scored) -> Model:
    """Return the model with its effects switched off and everything else unchanged."""
    return best.fit.model.with_values({name: 0.0 for h in best.hypotheses for name in h.amplitudes})


def _rival_model(found: Search, answer: Scored, rival: Hypothesis) -> Model | None:
    for one in found.tried.values():
        if len(one.hypotheses) == len(answer.hypotheses) and rival.key in one.keys:
            return one.fit.model
    return None


def _smallest(found: Search) -> str:
    """What would have been seen: the size at which usual effects reach the threshold, and where."""
    texts, scanned = [], found.claims
    for word in (
        "fluid_convection",
        "friction_speed",
        "evaporation_drying",
        "flooded_gap",
        "second_thermal_mass",
    ):
        claims = [c for c in scanned if c.hypothesis.effect.word == word]
        seen = [c for c in claims if _size_is_known(c) and _visible(c) <= _largest(found, c.hypothesis)]
        if not seen:
            continue
        size, c = max(((_visible(c), c) for c in seen), key=lambda item: item[0])
        h = c.hypothesis
        speed = f" at {h.effect.at}" if h.effect.at else ""
        alone = {c.hypothesis.places for c in seen if len(c.hypothesis.places) == 1}
        each = [p for c in seen if (p := c.hypothesis.places) in alone or not {(one,) for one in p} <= alone]
        places = list(dict.fromkeys(map(" and ".join, each)))  # those of a group are there each
        everywhere = len(seen) == len(claims) and len(places) > 1 and h.effect.place in _ANYWHERE
        where = _ANYWHERE[h.effect.place] if everywhere else f"at {'; '.join(places)}"
        unit = h.units.get(h.amplitudes[0], "1")
        texts.append(f"{word} of {sized(size, unit, 2)}{speed} {where}")
    return (
        "these recordings would have shown " + ", ".join(texts)
        if texts
        else "record longer and move the inputs more: these recordings would not show a usual effect"
    )


def _visible(claim: Score) -> float:
    """The size that would have been seen."""
    return 4.5 * abs(claim.size[0] / claim.t)


def _largest(found: Search, h: Hypothesis) -> float:
    """The largest size worth saying: 3 standard deviations of the logarithm above what is usual."""
    slab = found.context.slab([h])
    return min(h.effect.amplitude.most, float(slab.median[0] * slab.factor[0] ** 3))


def _size_is_known(claim: Score) -> bool:
    h = claim.hypothesis
    is_size = h.effect.amplitude.fixed is None and h.recording is None
    return is_size and claim.t != 0 and claim.share > INVISIBLE


_ANYWHERE = {
    "body": "at any body",
    "fluid-free body": "at any body without fluid",
    "driven body": "at any driven body",
    "any pair": "between any two bodies",
}
