"""Context of a diagnosis: the recordings to fit, the noise settings, and the prior of the size of each
effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.left_open import Usual
from discovery.diagnosis.sizes import Sizes
from discovery.dynamics import Grid, make_grid
from discovery.effects.candidates import candidates
from discovery.effects.form import ROLE_OF, Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.scene import Scene
from discovery.evidence.bayes import Slab
from discovery.evidence.form_error import are_others, model_form
from discovery.evidence.late import perhaps_late
from discovery.evidence.noisy import log_likelihood, perhaps_noisy, smoothed
from discovery.evidence.outliers import Outlier, find_outliers, without
from discovery.evidence.process_noise import floors, reading_noise
from discovery.evidence.settings import Prior, Settings, settings
from discovery.fitting import Fit, Noise, fit_model
from discovery.models import Model
from discovery.recordings import Campaign

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
        thresholds.TIMES,
    )


@dataclass(frozen=True)
class Form:
    """Form errors of a fitted model: by recording what the readings show more (R, Y, M) for a share of one,
    and how many of these are of laws, places, zeros of thermometers, and air at bodies.
    """

    columns: tuple[Array, ...]
    kinds: tuple[int, int, int, int]

    @classmethod
    def of(cls, fit: Fit, white: Noise, thermometers: Sequence[str], air: Sequence[str]) -> Form:
        """Those where a fit is; `white`: the reading noise, in which directions are compared."""
        columns, kinds = model_form(fit, np.array(white.white), thermometers, air)
        return cls(tuple(columns), kinds)


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
    settings: Settings
    floor: Mapping[str, float]  # of the process noise of each state at level one
    belief: Mapping[str, float]  # log of the factor within which each of its start values is known
    outliers: tuple[Outlier, ...]  # set aside
    form: Form  # of models with effects: of the baseline, later of the answer
    formed: Fit  # where it was found
    own_form: Form  # of the baseline
    thermometers: tuple[str, ...]  # that the model uses or shows
    sizes: Sizes  # prior of amplitudes, along the baseline; the same under every reading noise

    @property
    def white(self) -> Noise:
        """The reading noise."""
        return self.settings.white

    @property
    def blocks(self) -> int:
        """Blocks of time in each recording."""
        return max(3, round(thresholds.BLOCKS / len(self.recordings)))

    @property
    def usual(self) -> Noise:
        """The noise that is most likely before the recordings are read."""
        return self.settings.usual.noise

    @property
    def unused_readings(self) -> list[str]:
        """Channels that were measured and that the model gives, but that are no outputs."""
        given = dict.fromkeys([*self.model.states, *self.model.outputs])
        measured = {n for n, c in self.campaign.channels.items() if c.measured}
        recorded = set(recorded_inputs(self.campaign, self.recordings, self.outputs))
        return [n for n in given if n in measured & recorded]

    @cached_property
    def candidates(self) -> list[Hypothesis]:
        """Every effect at every place of the model where it can act."""
        return candidates(self.model, self.effects, self.scene)

    def form_of(self, chosen: Sequence[Hypothesis]) -> Form:
        """Form errors of a model with some effects. A share of flows that the baseline does not have excuses
        nothing: a motor without its heat has hardly any.
        """
        return self.form if chosen else self.own_form

    @property
    def usually_off(self) -> Usual:
        """Zeros of thermometers, and the air at bodies, as the search allows for them."""
        air = tuple(ambient_of(self.campaign))
        return Usual(self.thermometers, thresholds.AIR, air, thresholds.LAYERS)

    def slab(self, hypotheses: Sequence[Hypothesis]) -> Slab:
        """Prior of the size of each amplitude."""
        return self.sizes.slab(hypotheses)


def make_context(
    campaign: Campaign,
    model: Model,
    recordings: Sequence[str],
    outputs: Sequence[str],
    effects: Sequence[Effect],
    after: Mapping[str, tuple[str, ...]],
    begin: Fit | None = None,
) -> Context:
    """Fit the baseline to all recordings together and find the noise levels for the tests.

    Only `recordings` are looked at.

    Args:
        after: by recording, those of the whole campaign that were made then or later.
        begin: a fit of the same model to the same recordings.
    """
    inputs = recorded_inputs(campaign, recordings, outputs)
    whole = {r: make_grid(campaign, r, inputs, outputs, coarse=NODES, most=2 * NODES) for r in recordings}
    # a guess may be as far off as usual sizes lie apart: without any belief a capacity of 100 J/K became 1e8
    width = 2 * log(thresholds.FACTOR) if model.guessed else thresholds.BELIEF
    belief = dict.fromkeys(model.free, width)  # the sizes of effects are free
    stated = {name: campaign.channels[name].noise for name in outputs}

    def fitted(grids: Mapping[str, Grid], begin: Fit | None = None) -> Fit:
        return fit_model(model, campaign, recordings, outputs, grids=grids, belief=belief, begin=begin)

    grids = thinned(whole)
    fit = fitted(grids, begin)
    whole = perhaps_late(fit, campaign, whole, thresholds.SHORT)
    if any(g.unsure for g in whole.values()):
        grids = thinned(whole)
        fit = fitted(grids, fit)
    ambient = ambient_of(campaign)
    floor = floors(fit, thresholds.FLOOR, ambient, thresholds.AIR)
    white = reading_noise(fit, stated, floor, process_prior())
    outliers = find_outliers(fit, whole, np.array(white.white))
    if outliers:
        grids = thinned(without(whole, outliers))
        fit = fitted(grids, fit)
        white = reading_noise(fit, stated, floor, process_prior())
    grids = perhaps_noisy(fit, campaign, grids, white, thresholds.SHORT)
    if any(g.noisy for g in grids.values()):
        plain = [s.noise for s in _settings(white, floor, grids) if s.is_plain]
        both = [(fitted(one, fit), one) for one in (grids, smoothed(grids))]
        fit, grids = max(both, key=lambda one: log_likelihood(one[0], plain))
    thermometers = _thermometers(fit, campaign)
    form = Form.of(fit, white, thermometers, ambient)
    spreads = fit.problem.start_spreads()
    own = {n: replace(s, start_sd=spreads.get(n, s.start_sd)) for n, s in model.states.items()}
    scene = replace(make_scene(campaign, model, recordings, outputs, after), spacing=_spacing(grids))
    model = replace(model, states=own)  # how far states begin from their starts is found once
    noises = _settings(white, floor, grids)
    return Context(
        campaign,
        model,
        tuple(recordings),
        tuple(outputs),
        grids,
        tuple(shown_by(grids, effects, scene)),
        scene,
        fit,
        noises,
        floor,
        belief,
        tuple(outliers),
        form,
        fit,
        form,
        thermometers,
        Sizes(model, fit.trajectories, noises.white),
    )


def ambient_of(campaign: Campaign) -> list[str]:
    """Channels of the temperature of the air."""
    return [n for n, channel in campaign.channels.items() if channel.role == "ambient temperature"]


def _thermometers(fit: Fit, campaign: Campaign) -> tuple[str, ...]:
    used = dict.fromkeys([*sorted({*fit.model.inputs, *fit.model.start_names}), *fit.problem.outputs])
    return tuple(n for n in used if n in campaign.channels and campaign.channels[n].unit == "degC")


def with_noise_of(context: Context, fit: Fit) -> Context:
    """The context with the reading noise of a better fit, if the campaign states none, and with the form
    errors of its bodies, where they are others: a fit without an effect may link two bodies a thousand times
    as well as they are.
    """
    stated = {name: context.campaign.channels[name].noise for name in context.outputs}
    white = reading_noise(fit, stated, context.floor, process_prior())
    noises = _settings(white, context.floor, context.grids, context.settings.coarser, context.settings.slower)
    if not are_others(context.formed.trajectories, fit.trajectories):
        return replace(context, settings=noises)
    form = Form.of(fit, white, context.thermometers, ambient_of(context.campaign))
    return replace(context, settings=noises, form=form, formed=fit)


def with_worse(
    context: Context, coarser: tuple[str, ...] | None = None, slower: tuple[str, ...] | None = None
) -> Context:
    """The context with states that may be off by more than the others, or with outputs whose slow noise may
    be larger; None leaves them as they are.
    """
    known = context.settings.coarser, context.settings.slower
    states, outputs = (old if new is None else new for old, new in zip(known, (coarser, slower), strict=True))
    noises = _settings(context.white, context.floor, context.grids, states, outputs)
    return replace(context, settings=noises)


def _settings(
    white: Noise,
    floor: Mapping[str, float],
    grids: Mapping[str, Grid],
    coarser: tuple[str, ...] = (),
    slower: tuple[str, ...] = (),
) -> Settings:
    unsure, noisy = any(g.unsure for g in grids.values()), any(g.noisy for g in grids.values())
    return settings(white, floor, process_prior(), unsure, noisy, coarser, slower)


def thinned(grids: Mapping[str, Grid]) -> dict[str, Grid]:
    """The grids with every k-th reading, if there are more than a search can use in reasonable time.

    Sensors that are read every second say little more than every few seconds: slow noise limits a diagnosis.
    """
    every = -(-sum(len(g.read) for g in grids.values()) // MOST_READINGS)
    return {r: g.part(slice(None, None, every)) for r, g in grids.items()}


def recorded_inputs(campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]) -> list[str]:
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


def make_scene(
    campaign: Campaign,
    model: Model,
    recordings: Sequence[str],
    outputs: Sequence[str],
    after: Mapping[str, tuple[str, ...]],
) -> Scene:
    """What candidates for a model are made for. `after`: as in `make_context`."""
    inputs = recorded_inputs(campaign, recordings, outputs)
    return Scene(
        campaign.channels,
        tuple(outputs),
        tuple(recordings),
        after,
        {n: size for n in inputs if (size := _largest(campaign, recordings, n)) > 0},
        frozenset(set(inputs) - set(model.inputs)),
        thresholds.ODDS,
        thresholds.ODDS,
    )


def _spacing(grids: Mapping[str, Grid]) -> float:
    """Seconds between two readings, of the recording where they come most often."""
    return min(float(np.median(np.diff(g.time[g.read]))) for g in grids.values() if len(g.read) > 1)


def shown_by(grids: Mapping[str, Grid], effects: Sequence[Effect], scene: Scene) -> list[Effect]:
    """The effects, their generic time constants limited to those that the recordings can show, their sizes at
    a speed that the machine has. What users state counts at the speed that they state.
    """
    duration = max(float(g.time[-1] - g.time[0]) for g in grids.values())
    top = max(
        (v for n, v in scene.largest.items() if scene.channels[n].role == ROLE_OF["speed"]), default=0.0
    )
    return [
        replace(
            e if e.group == "user" else e.up_to(top),
            shapes=tuple(s.within(0.5 * _spacing(grids), duration) for s in e.shapes),
        )
        for e in effects
    ]
