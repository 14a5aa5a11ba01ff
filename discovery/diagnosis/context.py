"""What a diagnosis works on: recordings that it may see, noise to expect, and how large effects can be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_grid
from discovery.fitting import Fit, Noise, fit_model
from discovery.mismatch.catalogue.effect import Effect
from discovery.mismatch.everyday import everyday, heat_limit, reading_noise
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.late import perhaps_late
from discovery.mismatch.outliers import Outlier, find_outliers, without
from discovery.mismatch.scales import scaled
from discovery.mismatch.signatures import heat_rms
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.terms import evaluate

Array = NDArray[np.float64]

BELIEF = 0.5  # a hand-built model's start values are believed within a factor of about two
MOST_READINGS = 6000  # instants, over all recordings
COARSE_READINGS = 4000  # of them, and of nodes, where recordings are so fine that they are coarsened anyway
COARSE_LINK = 0.5  # of what a link carries, below which another exchange beside it is its coarseness


@dataclass(frozen=True)
class Context:
    """Everything that stays the same while hypotheses are tried."""

    campaign: Campaign
    model: Model
    recordings: tuple[str, ...]
    outputs: tuple[str, ...]
    grids: Mapping[str, Grid]
    effects: tuple[Effect, ...]
    baseline: Fit
    settings: tuple[Noise, ...]  # everyday noise, from none to the limit
    heat_limit: Mapping[str, float]
    flows: Mapping[str, float]  # largest heat flow (or rate) by state, rms
    links: Mapping[frozenset[str], float]  # the same by pair of bodies that the model links
    belief: float | None
    outliers: tuple[Outlier, ...]  # set aside

    @property
    def fit_states(self) -> tuple[str, ...]:
        """States at which heat can be missing."""
        return tuple(self.heat_limit)

    def minor(self, h: Hypothesis) -> tuple[float, ...]:
        """Size of each amplitude below which an effect is the coarseness of a model with few bodies.

        A seventh of the usual size; the smaller the model is than the catalogue's machines (its flows bound
        the spread), the less of that bound, down to a fiftieth.
        """
        usual = h.effect.amplitude.plausible
        return tuple((0.02 + 0.13 * min(1.0, 2 * sd / usual)) * sd for sd in self.spread(h))

    def half_a_link(self, h: Hypothesis) -> tuple[float, ...]:
        """Size of each amplitude of an exchange at which it carries half of what the model's own link between
        the two bodies does; zero where there is none.

        A body is not of one temperature: what its joints conduct differs from one way of heating to another.
        """
        carried = self.links.get(frozenset(h.states), 0.0) if any(t.source for t in h.terms) else 0.0
        return (COARSE_LINK * carried / self._unit_flow(h) if carried else 0.0,) * len(h.amplitudes)

    def spread(self, h: Hypothesis) -> tuple[float, ...]:
        """Prior standard deviation of each amplitude: plausible, but no more than the model's own flows."""
        size = h.effect.amplitude.plausible
        if h.effect.amplitude.fixed is not None:
            return (size,) * len(h.amplitudes)
        if h.shown:
            unit = [self.campaign.channels[name].unit for name in h.shown]
            level = dict(zip(self.settings[0].outputs, self.settings[0].white, strict=True))
            return tuple(
                size if u in ("um", "um/m") or h.effect.amplitude.unit == "1" else min(size, 10 * level[name])
                for u, name in zip(unit, h.shown, strict=True)
            )[: len(h.amplitudes)]
        unit_flow, largest = self._unit_flow(h), max(self.flows.values())
        return (min(size, largest / unit_flow) if unit_flow > 0 else size,) * len(h.amplitudes)

    def _unit_flow(self, h: Hypothesis) -> float:
        """rms of what an effect of size one makes flow along the baseline. The largest recording counts: one
        may be dry, and which comes first says nothing.
        """
        ones = {**h.shapes, **dict.fromkeys(h.amplitudes, 1.0)}
        return max(
            _rms(evaluate(t.expression, {**run.at_ends(), **ones}, memory=run.system.ends).value)
            for run in self.baseline.trajectories
            if h.recording in (None, run.system.grid.recording)
            for t in h.terms
        )


def make_context(
    campaign: Campaign,
    model: Model,
    recordings: Sequence[str],
    outputs: Sequence[str],
    effects: Sequence[Effect],
    physical: bool = True,
) -> Context:
    """Fit the baseline jointly and find the noise levels that tests must reckon with.

    Only `recordings` are looked at.
    """
    inputs = [
        name
        for name, channel in campaign.channels.items()
        if name not in outputs
        and channel.role not in ("error", "applied correction")
        and all(
            np.isfinite(campaign.recordings[r].values.get(name, np.array([np.nan]))).any() for r in recordings
        )
    ]
    coarse = COARSE_READINGS // len(recordings)
    whole = {r: make_grid(campaign, r, inputs, outputs, coarse=coarse) for r in recordings}
    grids = thinned(whole)
    belief = BELIEF if physical and any(state.capacity for state in model.states.values()) else None
    fit = fit_model(model, campaign, recordings, outputs, grids=grids, belief=belief)
    whole = perhaps_late(fit, whole)
    if any(g.unsure for g in whole.values()):
        grids = thinned(whole)
        fit = fit_model(model, campaign, recordings, outputs, grids=grids, belief=belief, begin=fit)
    flows = _flows(fit)
    limit = heat_limit(fit.problem.model, flows)
    duration = max(float(g.time[-1] - g.time[0]) for g in grids.values())
    white = reading_noise(fit, {name: campaign.channels[name].noise for name in outputs}, limit, duration)
    outliers = find_outliers(fit, whole, np.array(white.white))
    if outliers:
        grids = thinned(without(whole, outliers))
        fit = fit_model(model, campaign, recordings, outputs, grids=grids, belief=belief)
        white = reading_noise(fit, {name: campaign.channels[name].noise for name in outputs}, limit, duration)
    settings = everyday(white, limit, any(g.unsure for g in grids.values()))
    return Context(
        campaign,
        model,
        tuple(recordings),
        tuple(outputs),
        grids,
        tuple(scaled(e, duration) for e in effects),
        fit,
        settings,
        limit,
        flows,
        _links(fit),
        belief,
        tuple(outliers),
    )


def _rms(series: Array | float) -> float:
    return float(np.sqrt(np.mean(np.square(series))))


def thinned(grids: Mapping[str, Grid]) -> dict[str, Grid]:
    """The grids with every k-th reading, where there are more than a search can use in reasonable time.

    Sensors that are read every second say little more than every few seconds: slow noise limits a diagnosis.
    """
    every = -(-sum(len(g.read) for g in grids.values()) // MOST_READINGS)
    return {r: replace(g, read=g.read[::every], readings=g.readings[::every]) for r, g in grids.items()}


def seen_beside(context: Context, fit: Fit) -> Context:
    """The context with the reading noise as it stands beside a better fit, where the campaign does not
    state it.
    """
    channels = context.campaign.channels
    stated = {name: channels[name].noise for name in context.outputs}
    duration = max(float(g.time[-1] - g.time[0]) for g in context.grids.values())
    white = reading_noise(fit, stated, context.heat_limit, duration)
    unsure = any(g.unsure for g in context.grids.values())
    return replace(context, settings=everyday(white, context.heat_limit, unsure))


def _flows(fit: Fit) -> dict[str, float]:
    flows: dict[str, float] = {}
    for trajectory in fit.trajectories:
        for term in trajectory.system.model.terms:
            size = heat_rms(trajectory, term.expression)
            for state in (term.into, term.source):
                if state:
                    flows[state] = max(flows.get(state, 0.0), size)
    return flows


def _links(fit: Fit) -> dict[frozenset[str], float]:
    links: dict[frozenset[str], float] = {}
    for trajectory in fit.trajectories:
        for term in trajectory.system.model.terms:
            if term.source:
                pair, size = frozenset((term.into, term.source)), heat_rms(trajectory, term.expression)
                links[pair] = max(links.get(pair, 0.0), size)
    return links
