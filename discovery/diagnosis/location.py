"""Where the mismatch is: in which errors, at which bodies, when, and in which regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis.context import Context
from discovery.diagnosis.posterior import Posterior
from discovery.diagnosis.regime import heat_of, of_effects, of_free_heat
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.verdict import Verdict
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.latent_force import Force

Array = NDArray[np.float64]

MOST_WINDOWS = 8


@dataclass(frozen=True)
class Window:
    """A span of a recording in which heat is missing (mean, W or rate)."""

    recording: str
    start_s: float
    end_s: float
    state: str
    heat: float


@dataclass(frozen=True)
class Location:
    """Shares by output and state, windows, and a rule over inputs and states."""

    outputs: Mapping[str, float]
    states: Mapping[str, float]
    windows: tuple[Window, ...]
    regime: str | None


def locate(
    context: Context, baseline: Scored, verdict: Verdict, posterior: Posterior, forces: Sequence[Force]
) -> Location:
    """Locate the residual of the baseline.

    Outputs by what the answer removes of their residual, states by the posterior, windows and regime from the
    missing heat itself.
    """
    best, named = verdict.answer, [n.hypothesis for n in verdict.named]
    acting = [h for h in named if h.terms and h.recording is None]
    rule = of_effects(best, acting, baseline.fit.problem.model) if acting else None
    if not named and forces and forces[0].gain > 0:
        rule = of_free_heat(baseline, forces[0])
    return Location(
        _outputs(baseline, best),
        _states(posterior, forces),
        _windows(context, best, named, forces),
        rule,
    )


def _shares(values: Mapping[str, float]) -> dict[str, float]:
    total = sum(values.values())
    return {name: round(v / total, 3) for name, v in values.items()} if total > 0 else {}


def _outputs(baseline: Scored, best: Scored) -> dict[str, float]:
    names, white = baseline.fit.problem.outputs, np.array(baseline.grams[0].noise.white)
    squares = np.zeros(len(names))
    for old, new in zip(baseline.seen.residuals, best.seen.residuals, strict=True):
        rest = np.nansum((new / white) ** 2, axis=0) if best.hypotheses else np.isfinite(old).sum(axis=0)
        squares += np.nansum((old / white) ** 2, axis=0) - rest
    return _shares({name: max(float(s), 0.0) for name, s in zip(names, squares, strict=True)})


def _states(posterior: Posterior, forces: Sequence[Force]) -> dict[str, float]:
    """Share of each state in the posterior of the effects, or of the latent force if there is none."""
    weight: dict[str, float] = {f.state: 0.0 for f in forces}
    for model, p in zip(posterior.models, posterior.shares, strict=True):
        places = [h.states for h in model.hypotheses if h.states]
        places += [(model.forced_state,)] if model.forced_state else []
        for states in places:
            for state in states:
                weight[state] = weight.get(state, 0.0) + float(p) / len(states) / len(places)
    if not any(weight.values()) and forces:
        top = forces[0].gain
        weight = {f.state: float(np.exp(0.5 * (f.gain - top))) for f in forces}
    return dict(sorted(_shares(weight).items(), key=lambda item: -item[1]))


def _windows(
    context: Context, best: Scored, named: Sequence[Hypothesis], forces: Sequence[Force]
) -> tuple[Window, ...]:
    found: list[tuple[float, Window]] = []
    values = [h for h in named if h.terms]
    for trajectory in best.fit.trajectories:
        run, time = trajectory.system.grid.recording, trajectory.system.grid.time
        offset = context.campaign.recordings[run].start
        for h in values:
            if not h.acts_in(run):
                continue
            for place in dict.fromkeys(t.into for t in h.terms) if h.states else ("",):
                heat = heat_of(best, trajectory, h, place)
                series = 0.5 * (heat[0::2] + heat[1::2])
                level = 0.5 * float(np.percentile(np.abs(series), 95))
                found += _spans(time, series, level, run, place, offset)
    if not values and forces and forces[0].gain > 0:
        f = forces[0]
        for run, heat in f.heat.items():
            level = np.maximum(2 * f.sd[run], 0.3 * np.max(np.abs(heat)))
            found += _spans(f.edges[run], heat, level, run, f.state, context.campaign.recordings[run].start)
    found.sort(key=lambda item: -item[0])
    return tuple(sorted((w for _, w in found[:MOST_WINDOWS]), key=lambda w: (w.recording, w.start_s)))


def _spans(
    edges: Array, series: Array, level: float | Array, run: str, state: str, offset: float
) -> list[tuple[float, Window]]:
    """Spans in which |series| (K,) between edges (K + 1,) exceeds the level, with their energy."""
    sign = np.where(np.abs(series) > np.maximum(level, 1e-12), np.sign(series), 0.0)
    out = []
    k = 0
    while k < len(sign):
        if sign[k] == 0:
            k += 1
            continue
        end = k
        while end + 1 < len(sign) and sign[end + 1] == sign[k]:
            end += 1
        width = np.diff(edges[k : end + 2])
        energy = float(np.sum(series[k : end + 1] * width))
        span = float(edges[end + 1] - edges[k])
        out.append(
            (
                abs(energy),
                Window(run, offset + float(edges[k]), offset + float(edges[end + 1]), state, energy / span),
            )
        )
        k = end + 1
    return out
