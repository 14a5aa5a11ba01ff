"""What became of the effects of the experiment file, those of one's own: named, or searched and lost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from discovery.diagnosis import thresholds
from discovery.diagnosis.selection import Search
from discovery.diagnosis.verdict import Verdict
from discovery.effects.form import Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.printed import printed


@dataclass(frozen=True)
class Searched:
    """An own effect at its likeliest place.

    `gain`: log evidence over the model without any effect, to first order. `below`: how much less log
    evidence than the answer the best refitted model with it has; None if it was not worth a refit.
    """

    hypothesis: Hypothesis
    gain: float
    below: float | None
    named: bool

    def sentence(self) -> str:
        """That it was searched and is not named, with its log evidence."""
        h = self.hypothesis
        said = (
            f"{h.effect.word} was searched, and not named: at {h.where} it has a log evidence of "
            f"{printed(self.gain)}; a name needs {thresholds.SHORT:g}"
        )
        if self.below:
            said += f". The best model with it has {printed(self.below)} less log evidence than the answer"
        return said


def searched(found: Search, verdict: Verdict, effects: Sequence[Effect]) -> Iterator[Searched]:
    """Each own effect that has a place in the model."""
    named = {n.hypothesis.effect.word: n.hypothesis for n in verdict.named}
    for effect in effects:
        best = next((c for c in found.claims if c.hypothesis.effect.word == effect.word), None)
        if best is None:  # it has no place in the model
            continue
        fitted = [
            one.evidence
            for one in found.tried.values()
            if any(h.effect.word == effect.word for h in one.hypotheses)
        ]
        yield Searched(
            named.get(effect.word, best.hypothesis),
            best.gain,
            max(verdict.answer.evidence - max(fitted), 0.0) if fitted else None,
            effect.word in named,
        )
