"""Where the mismatch is: in which errors, at which bodies, when, and in which regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.forcing import Forcing
from discovery.mismatch.regime import heat_of, of_effects, of_free_heat
from discovery.mismatch.verdict import Named

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
    context: Context,
    baseline: Assessment,
    best: Assessment,
    named: Sequence[Named],
    before: Sequence[Forcing],
) -> Location:
    """Location of what the baseline leaves.

    Outputs by the excess of its residual over the reading noise, states by free forcing (and by the named
    effects where there are some), windows and regime from the missing heat itself.
    """
    acting = [n.hypothesis for n in named if n.hypothesis.terms and n.hypothesis.recording is None]
    rule = of_effects(best, acting, baseline.fit.problem.model) if acting else None
    if not named and before and before[0].gain > 0:
        rule = of_free_heat(baseline, before[0])
    return Location(
        _outputs(baseline, best),
        _states(before, named),
        _windows(context, best, named, before),
        rule,
    )


def _shares(values: Mapping[str, float]) -> dict[str, float]:
    total = sum(values.values())
    return {name: round(v / total, 3) for name, v in values.items()} if total > 0 else {}


def _outputs(baseline: Assessment, best: Assessment) -> dict[str, float]:
    names, white = baseline.fit.problem.outputs, np.array(baseline.views[0].noise.white)
    squares = np.zeros(len(names))
    for old, new in zip(baseline.lens.residuals, best.lens.residuals, strict=True):
        rest = np.nansum((new / white) ** 2, axis=0) if best is not baseline else np.isfinite(old).sum(axis=0)
        squares += np.nansum((old / white) ** 2, axis=0) - rest
    return _shares({name: max(float(s), 0.0) for name, s in zip(names, squares, strict=True)})


def _states(before: Sequence[Forcing], named: Sequence[Named]) -> dict[str, float]:
    if not before:
        return {}
    top = before[0].gain
    free = _shares({f.state: float(np.exp(0.5 * (f.gain - top))) for f in before})
    physical = [n for n in named if n.hypothesis.states]
    if not physical:
        return dict(sorted(free.items(), key=lambda item: -item[1]))
    weight: dict[str, float] = dict.fromkeys(free, 0.0)
    for n in physical:
        answers = [(n.hypothesis, 0.0), *((r.hypothesis, r.below) for r in n.rivals)]
        odds = [float(np.exp(-gap)) for _, gap in answers]
        for (h, _), odd in zip(answers, odds, strict=True):
            for state in h.states:
                weight[state] = weight.get(state, 0.0) + odd / sum(odds) / len(h.states)
    return dict(sorted(_shares(weight).items(), key=lambda item: -item[1]))


def _windows(
    context: Context, best: Assessment, named: Sequence[Named], before: Sequence[Forcing]
) -> tuple[Window, ...]:
    found: list[tuple[float, Window]] = []
    values = [n.hypothesis for n in named if n.hypothesis.terms]
    for trajectory in best.fit.trajectories:
        run, time = trajectory.system.grid.recording, trajectory.system.grid.time
        offset = context.campaign.recordings[run].start
        for h in values:
            if h.recording not in (None, run):
                continue
            place = h.states[0] if h.states else ""
            heat = heat_of(best, trajectory, h)
            series = 0.5 * (heat[0::2] + heat[1::2])
            found += _spans(time, series, 0.5 * float(np.percentile(np.abs(series), 95)), run, place, offset)
    if not values and before and before[0].gain > 0:
        f = before[0]
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
