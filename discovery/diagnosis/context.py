"""Context of a diagnosis: the recordings to fit, the noise settings, and the prior of the size of each
effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.dynamics import Grid, make_grid
from discovery.effects.candidates import Scene, candidates
from discovery.effects.form import Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import Slab
from discovery.evidence.form_error import model_form
from discovery.evidence.late import perhaps_late
from discovery.evidence.outliers import Outlier, find_outliers, without
from discovery.evidence.process_noise import (
    Prior,
    Setting,
    floors,
    flow_sizes,
    neighbours,
    reading_noise,
    settings,
)
from discovery.evidence.signatures import signatures
from discovery.fitting import Fit, Noise, fit_model
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.terms import evaluate

Array = NDArray[np.float64]

MOST_READINGS = 4000  # instants, over all recordings
NODES = 1000  # of a recording, about, and its readings: inputs are their means in between


def process_prior() -> Prior:
    """Prior of process noise."""
    return Prior(
        thresholds.FLOOR,
        thresholds.SHARE,
        thresholds.LEVELS,
        thresholds.SHARES,
        thresholds.SLOW,
        thresholds.FORMS,
    )


@dataclass(frozen=True)
class Context:
    """Everything that stays the same while hypotheses are tried."""

    campaign: Campaign
    model: Model
    recordings: tuple[str, ...]
    outputs: tuple[str, ...]
    grids: Mapping[str, Grid]
    effects: tuple[Effect, ...]
    scene: Scene
    baseline: Fit
    settings: tuple[Setting, ...]
    floor: Mapping[str, float]  # of the process noise of each state at level one
    belief: float | None
    outliers: tuple[Outlier, ...]  # set aside
    form: tuple[Array, ...]  # by recording (R, Y, M): form errors of the model, for a share of one
    laws: int  # of these, the first, that are of laws and not of edges
    known: dict[tuple[str, ...], list[tuple[float, float, float]]] = field(default_factory=dict, repr=False)

    @property
    def white(self) -> Noise:
        """The reading noise."""
        return self.settings[0].noise

    @property
    def blocks(self) -> int:
        """Blocks of time in each recording."""
        return max(3, round(thresholds.BLOCKS / len(self.recordings)))

    @property
    def usual(self) -> Noise:
        """The noise that is most likely before the recordings are read."""
        return max(self.settings, key=lambda s: s.log_weight).noise

    @cached_property
    def next_to(self) -> tuple[tuple[int, ...], ...]:
        """The noise settings next to each one, by index."""
        return neighbours([s.place for s in self.settings])

    @cached_property
    def candidates(self) -> list[Hypothesis]:
        """Every effect at every place of the model where it can act."""
        return candidates(self.model, self.effects, self.scene)

    def slab(self, hypotheses: Sequence[Hypothesis]) -> Slab:
        """Prior of the size of each amplitude: usual on machines of the catalogue, but no more than a share
        of what flows in the model; of what an output shows more, some reading noises.
        """
        for h in hypotheses:
            if h.amplitudes not in self.known:
                self.known[h.amplitudes] = self._sizes(h)
        found = [one for h in hypotheses for one in self.known[h.amplitudes]]
        median, factor, sign = (np.array(column, dtype=float) for column in zip(*found, strict=True))
        return Slab(median, factor, sign)

    def _sizes(self, h: Hypothesis) -> list[tuple[float, float, float]]:
        amplitude, count = h.effect.amplitude, len(h.amplitudes)
        if amplitude.most < np.inf or (h.terms and not h.effect.is_physics):
            return [(amplitude.plausible, thresholds.FACTOR, float(amplitude.sign))] * count
        if h.shown:
            return [
                (thresholds.JUMP * noise / max(size, 1e-12), thresholds.FACTOR, float(amplitude.sign))
                for size, noise in self._shown(h)
            ]
        states = {t.into for t in h.terms}
        kind = any(self.model.states[s].capacity for s in states if s in self.model.states)
        largest = max(v for n, v in self.flows.items() if bool(self.model.states[n].capacity) == kind)
        usual = min(amplitude.plausible, thresholds.USUAL * largest / max(self._unit_flow(h), 1e-300))
        return [(usual, thresholds.FACTOR, float(amplitude.sign))] * count

    @cached_property
    def flows(self) -> dict[str, float]:
        """rms of what flows through each state of the baseline."""
        return {n: v for n, v in flow_sizes(self.baseline).items() if n in self.model.states}

    def _shown(self, h: Hypothesis) -> list[tuple[float, float]]:
        """For each amplitude: rms of the outputs for an amplitude of one, and the reading noise there."""
        white = dict(zip(self.outputs, self.white.white, strict=True))
        several = len(h.amplitudes) > 1
        names = list(h.shown) if several else [next(iter(h.shown))]
        size = np.zeros(len(names))
        for run in self.baseline.trajectories:
            for k, name in enumerate(names):
                column = signatures(run, [h])[:, self.outputs.index(name), k]
                size[k] = max(size[k], float(np.sqrt(np.mean(column**2))))
        return [(float(size[k]), white[name]) for k, name in enumerate(names)]

    def _unit_flow(self, h: Hypothesis) -> float:
        """rms of what an effect of size one lets flow along the baseline. The largest recording counts: one
        may be dry, and which comes first says nothing.
        """
        found = 0.0
        for run in self.baseline.trajectories:
            values = {**run.at_ends(), **h.values(run.system.grid.recording)}
            for term in h.terms:
                series = evaluate(term.expression, values, memory=run.system.ends).value
                found = max(found, float(np.sqrt(np.mean(np.square(series)))))
        return found


def make_context(
    campaign: Campaign,
    model: Model,
    recordings: Sequence[str],
    outputs: Sequence[str],
    effects: Sequence[Effect],
    after: Mapping[str, tuple[str, ...]],
) -> Context:
    """Fit the baseline to all recordings together and find the noise levels for the tests.

    Only `recordings` are looked at.

    Args:
        after: by recording, those of the whole campaign that were made then or later.
    """
    inputs = _inputs(campaign, recordings, outputs)
    whole = {r: make_grid(campaign, r, inputs, outputs, coarse=NODES, most=2 * NODES) for r in recordings}
    belief = None if model.guessed else thresholds.BELIEF
    stated = {name: campaign.channels[name].noise for name in outputs}

    def fitted(grids: Mapping[str, Grid], begin: Fit | None = None) -> Fit:
        return fit_model(model, campaign, recordings, outputs, grids=grids, belief=belief, begin=begin)

    grids = thinned(whole)
    fit = fitted(grids)
    whole = perhaps_late(fit, whole)
    if any(g.unsure for g in whole.values()):
        grids = thinned(whole)
        fit = fitted(grids, fit)
    ambient = [n for n, channel in campaign.channels.items() if channel.role == "ambient temperature"]
    floor = floors(fit, thresholds.FLOOR, ambient, thresholds.AIR)
    white = reading_noise(fit, stated, floor, process_prior())
    outliers = find_outliers(fit, whole, np.array(white.white))
    if outliers:
        grids = thinned(without(whole, outliers))
        fit = fitted(grids, fit)
        white = reading_noise(fit, stated, floor, process_prior())
    form, laws = model_form(fit, np.array(white.white))
    spreads = fit.problem.start_spreads()
    own = {n: replace(s, start_sd=spreads.get(n, s.start_sd)) for n, s in model.states.items()}
    scene = Scene(
        campaign.channels,
        tuple(outputs),
        tuple(recordings),
        after,
        {n: size for n in inputs if (size := _largest(campaign, recordings, n)) > 0},
        frozenset(set(inputs) - set(model.inputs)),
        thresholds.ODDS,
        thresholds.ODDS,
    )
    duration = max(float(g.time[-1] - g.time[0]) for g in grids.values())
    spacing = min(float(np.median(np.diff(g.time[g.read]))) for g in grids.values() if len(g.read) > 1)
    return Context(
        campaign,
        replace(model, states=own),  # how far states begin from their starts is found once
        tuple(recordings),
        tuple(outputs),
        grids,
        tuple(_within(e, spacing, duration) for e in effects),
        scene,
        fit,
        settings(white, floor, process_prior(), any(g.unsure for g in grids.values())),
        floor,
        belief,
        tuple(outliers),
        tuple(form),
        laws,
    )


def with_noise_of(context: Context, fit: Fit) -> Context:
    """The context with the reading noise of a better fit, if the campaign states none."""
    stated = {name: context.campaign.channels[name].noise for name in context.outputs}
    white = reading_noise(fit, stated, context.floor, process_prior())
    unsure = any(g.unsure for g in context.grids.values())
    return replace(context, settings=settings(white, context.floor, process_prior(), unsure))


def thinned(grids: Mapping[str, Grid]) -> dict[str, Grid]:
    """The grids with every k-th reading, if there are more than a search can use in reasonable time.

    Sensors that are read every second say little more than every few seconds: slow noise limits a diagnosis.
    """
    every = -(-sum(len(g.read) for g in grids.values()) // MOST_READINGS)
    return {r: g.part(slice(None, None, every)) for r, g in grids.items()}


def _inputs(campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]) -> list[str]:
    """Channels that could drive a model: recorded in every recording."""

    def known(name: str) -> bool:
        values = (campaign.recordings[r].values.get(name, np.array([np.nan])) for r in recordings)
        return all(np.isfinite(v).any() for v in values)

    return [
        name
        for name, channel in campaign.channels.items()
        if name not in outputs and channel.role not in ("error", "applied correction") and known(name)
    ]


def _largest(campaign: Campaign, recordings: Sequence[str], name: str) -> float:
    """Largest magnitude of an input that moves in some recordings; zero for an input that does not move."""
    series = np.concatenate([campaign.recordings[r].values[name] for r in recordings])
    series = series[np.isfinite(series)]
    return float(np.abs(series).max()) if np.ptp(series) > 0 else 0.0


def _within(effect: Effect, spacing: float, duration: float) -> Effect:
    """The effect, its generic time constants limited to those that the recordings can show."""
    return replace(effect, shapes=tuple(s.within(0.5 * spacing, duration) for s in effect.shapes))
