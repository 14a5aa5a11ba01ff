"""Prior of the sizes of effects: what is usual on machines of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from discovery.diagnosis import thresholds
from discovery.dynamics import Trajectory
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import Slab
from discovery.evidence.outliers import FAR
from discovery.evidence.process_noise import flows_at_least
from discovery.evidence.signatures import signatures
from discovery.fitting import Noise
from discovery.models import Model
from discovery.terms import evaluate


@dataclass(frozen=True)
class Sizes:
    """Prior of sizes along the free runs of a model: usual on machines of the catalogue, but no more than a
    share of what flows in the model; of what an output shows more, some reading noises.
    """

    model: Model
    trajectories: Sequence[Trajectory]
    noise: Noise  # the reading noise
    _known: dict[tuple[str, ...], list[tuple[float, float, float]]] = field(default_factory=dict, repr=False)

    def slab(self, hypotheses: Sequence[Hypothesis]) -> Slab:
        """Prior of each amplitude, in the order of the hypotheses."""
        for h in hypotheses:
            if h.amplitudes not in self._known:
                self._known[h.amplitudes] = self._of(h)
        found = [one for h in hypotheses for one in self._known[h.amplitudes]]
        median, factor, sign = np.array(found, dtype=float).reshape(-1, 3).T
        return Slab(median, factor, sign)

    def _of(self, h: Hypothesis) -> list[tuple[float, float, float]]:
        amplitude, count = h.effect.amplitude, len(h.amplitudes)
        is_share = amplitude.most < np.inf and amplitude.unit == "1"
        if is_share or (h.terms and not h.effect.is_physics):
            return [(amplitude.plausible, thresholds.FACTOR, float(amplitude.sign))] * count
        if h.shown:
            return [
                (FAR * noise / max(size, 1e-12), thresholds.FACTOR, float(amplitude.sign))
                for size, noise in self._shown(h)
            ]
        states = {t.into for t in h.terms}
        kind = any(self.model.states[s].capacity for s in states if s in self.model.states)
        largest = max(v for n, v in self._flows.items() if bool(self.model.states[n].capacity) == kind)
        usual = min(amplitude.plausible, thresholds.USUAL * largest / max(self._unit_flow(h), 1e-300))
        return [(usual, thresholds.FACTOR, float(amplitude.sign))] * count

    @cached_property
    def _flows(self) -> dict[str, float]:
        """rms of what flows through each state of the model, or of what would have to."""
        return {n: v for n, v in flows_at_least(self.trajectories).items() if n in self.model.states}

    def _shown(self, h: Hypothesis) -> list[tuple[float, float]]:
        """For each amplitude: rms of the outputs for an amplitude of one, and the reading noise there."""
        outputs = self.noise.outputs
        white = dict(zip(outputs, self.noise.white, strict=True))
        several = len(h.amplitudes) > 1
        names = list(h.shown) if several else [next(iter(h.shown))]
        size = np.zeros(len(names))
        for run in self.trajectories:
            for k, name in enumerate(names):
                column = signatures(run, [h])[:, outputs.index(name), k]
                size[k] = max(size[k], float(np.sqrt(np.mean(column**2))))
        return [(float(size[k]), white[name]) for k, name in enumerate(names)]

    def _unit_flow(self, h: Hypothesis) -> float:
        """rms of what an effect of size one lets flow along the free runs. The largest recording counts: one
        may be dry, and which comes first says nothing.
        """
        found = 0.0
        for run in self.trajectories:
            values = {**run.at_ends(), **h.values(run.system.grid.recording)}
            for term in h.terms:
                series = evaluate(term.expression, values, memory=run.system.ends).value
                found = max(found, float(np.sqrt(np.mean(np.square(series)))))
        return found
