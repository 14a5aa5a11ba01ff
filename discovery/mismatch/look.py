"""One look and one attempt: all claims scored on what a model leaves, and a refit with one of them added."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discovery.errors import RunsAwayError
from discovery.fitting import Noise
from discovery.fitting.fit import written_with
from discovery.mismatch.assess import WIDE, Assessment, assess, with_effects
from discovery.mismatch.context import Context
from discovery.mismatch.events import place_events
from discovery.mismatch.evidence import Board, Score, by_claim, make_board, scores
from discovery.mismatch.hypotheses import hypotheses
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.lens import Lens

SHARPER = 1.0  # log evidence that other instants of an event have to add


@dataclass(frozen=True)
class Look:
    """All claims scored on what an assessment leaves."""

    board: Board
    claims: tuple[Score, ...]


def look(context: Context, current: Assessment) -> Look:
    """Score every effect at every place on what the present model leaves."""
    model = current.fit.problem.model
    found = hypotheses(model, context.campaign.channels, context.outputs, context.recordings, context.effects)
    taken = {h.key for h in current.hypotheses}
    found = [h for h in found if h.key not in taken]
    spread = {a: WIDE * s for h in found for a, s in zip(h.amplitudes, context.spread(h), strict=True)}
    found = place_events(current.lens, current.best_view, found, spread)
    found = [h for h in found if not _start_of_shift(current, h)]
    board = make_board(
        current.lens, current.views, found, np.array([spread[a] for h in found for a in h.amplitudes])
    )
    return Look(board, tuple(by_claim(scores(board))))


def _start_of_shift(current: Assessment, h: Hypothesis) -> bool:
    """Whether an event only fills the start of a recording whose clock is shifted: no input is known
    there.
    """
    for o in current.hypotheses:
        if o.effect.word == "clock_shift" and o.recording == h.recording and o.shapes and h.shapes:
            (name,) = o.shapes
            shift = abs(current.model.parameters[name].values.get(h.recording or "", 0.0))
            return max(h.shapes.values()) <= 1.5 * shift
    return False


def attempt(
    context: Context,
    current: Assessment,
    others: tuple[Hypothesis, ...],
    claim: Hypothesis | None = None,
    sizes: tuple[float, ...] = (),
) -> Assessment | None:
    """Refit with others and a claim beside them, from the sizes that the linear look gives; None where the
    model runs away with them.
    """
    start: dict[str, float] = {}
    if claim and claim.effect.amplitude.fixed is None:
        start = dict(zip(claim.amplitudes, sizes, strict=True))
    chosen = (*others, claim) if claim else others
    return again(context, current, chosen, current.best_view.noise, start)


def again(
    context: Context,
    start: Assessment,
    chosen: tuple[Hypothesis, ...],
    noise: Noise,
    sizes: dict[str, float] | None = None,
) -> Assessment | None:
    """Refit with a set of effects from where an assessment stands; None where the model runs away: what it
    cannot run with is no explanation.
    """
    try:
        return assess(context, chosen, noise, start, sizes)
    except RunsAwayError:
        return None


def sharpened(context: Context, current: Assessment, event: Hypothesis) -> Assessment:
    """The model with the instants of an event sought anew, where that makes the readings more likely.

    They were found before anything else was fitted beside the event; a large one bends the whole model, and
    what an edge in the wrong place leaves looks like another event.
    """
    others = tuple(h for h in current.hypotheses if h is not event)
    noise = current.best_view.noise
    spread = dict(zip(event.amplitudes, (WIDE * s for s in context.spread(event)), strict=True))
    while True:
        rest = Lens(written_with(current.fit, with_effects(context, others), context.campaign))
        moved = place_events(rest, rest.view(noise), [event], spread)
        better = again(context, current, (*others, *moved), noise) if moved else None
        if better is None or better.evidence < current.evidence + SHARPER:
            return current
        current = better
