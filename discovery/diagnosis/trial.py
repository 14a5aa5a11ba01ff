"""Free runs of the given model and of a repaired one: on the recordings of the fit, and on held-out ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from discovery.diagnosis.context import Context
from discovery.diagnosis.left_open import Known
from discovery.diagnosis.proof import FreeRuns, Improvement, free_runs, improvement
from discovery.fitting import Fit, Noise
from discovery.recordings import Campaign


@dataclass(frozen=True)
class Runs:
    """Free runs of some outputs: on all fitted recordings together, on each held-out one, on each of all."""

    fit: Improvement
    held_out: dict[str, Improvement]
    each: dict[str, Improvement]


@dataclass(frozen=True)
class Trial:
    """What free runs are made of: recordings, the fitted model, its noise, and what its fit leaves open.

    `read`: held-out recordings with readings.
    """

    campaign: Campaign
    context: Context
    read: Sequence[str]
    before: Fit
    noise: Noise
    known: Known

    def runs(self, after: Fit, only: Sequence[int]) -> Runs:
        """Those of some outputs, with a repaired model; `only`: their indices."""
        shown, fit = [self.context.outputs[y] for y in only], self.context.recordings
        usual = self.context.usually_off
        found = (
            self._free(fit, after, self.known.of_fit(after, usual), only),
            self._free(self.read, after, self.known.of_unseen(usual), only),
        )
        fitted, held_out = ({r: improvement([one], shown) for r, one in runs.items()} for runs in found)
        return Runs(improvement(list(found[0].values()), shown), held_out, fitted | held_out)

    def fitted(self, after: Fit, only: Sequence[int]) -> Improvement:
        """Those of the fitted recordings alone."""
        known = self.known.of_fit(after, self.context.usually_off)
        runs = self._free(self.context.recordings, after, known, only)
        return improvement(list(runs.values()), [self.context.outputs[y] for y in only])

    def _free(
        self, recordings: Sequence[str], after: Fit, known: Known, only: Sequence[int]
    ) -> dict[str, FreeRuns]:
        return free_runs(self.campaign, recordings, self.before, after, self.noise, known, only)
