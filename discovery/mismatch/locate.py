"""Where the mismatch is: in which errors, at which bodies, when, and in which regime."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.forcing import Forcing
from discovery.mismatch.verdict import Named
from discovery.terms import evaluate

Array = NDArray[np.float64]

Bounds = dict[str, tuple[float, float]]  # of a variable: above, and up to

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
    return Location(
        _outputs(baseline, best),
        _states(before, named),
        _windows(context, best, named, before),
        regime(baseline, before[0]) if before and (before[0].gain > 0 or named) else None,
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
            heat = np.zeros(2 * len(trajectory.system.grid.step))
            place = h.states[0] if h.states else ""
            env = {**trajectory.at_ends(), **best.model.values(run)}
            for term in h.terms:
                if term.into == place or not place:
                    heat = heat + np.broadcast_to(
                        evaluate(term.expression, env, memory=trajectory.system.ends).value, heat.shape
                    )
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


def regime(baseline: Assessment, f: Forcing, seed: int = 0) -> str | None:
    """A rule over inputs and states, at most two deep, that says when heat is missing; None where none holds.

    The tree must beat 95 % of trees grown on heat whose days were shuffled.
    """
    from sklearn.tree import DecisionTreeRegressor

    features: list[Array] = []
    values: list[Mapping[str, Array | float]] = []
    names: list[str] = []
    heat: list[Array] = []
    for trajectory in baseline.fit.trajectories:
        run = trajectory.system.grid.recording
        nodes = {k: v for k, v in trajectory.at_nodes().items() if np.ndim(v) and k != "time"}
        time, edges = trajectory.system.grid.time, f.edges[run]
        names = list(nodes)
        values.append(nodes)
        block = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
        counts = np.maximum(np.bincount(block, minlength=len(edges) - 1), 1)
        features.append(
            np.column_stack(
                [np.bincount(block, v, minlength=len(edges) - 1) / counts for v in nodes.values()]
            )
        )
        heat.append(f.heat[run])
    x, y = np.concatenate(features), np.concatenate(heat)
    switches = {n for n in names if all(np.isin(nodes[n], (0.0, 1.0)).all() for nodes in values)}
    moving = np.ptp(x, axis=0) > 1e-9
    x, names = x[:, moving], [n for n, m in zip(names, moving, strict=True) if m]
    if not len(names) or np.ptp(y) == 0:
        return None

    def grow(target: Array) -> DecisionTreeRegressor:
        return DecisionTreeRegressor(max_depth=2, min_samples_leaf=max(6, len(y) // 12), random_state=0).fit(
            x, target
        )

    tree = grow(y)
    real = float(tree.score(x, y))
    rng = np.random.default_rng(seed)
    size = 12
    blocks = [np.arange(i, min(i + size, len(y))) for i in range(0, len(y), size)]
    shuffled = []
    for _ in range(40):
        target = y[np.concatenate([blocks[i] for i in rng.permutation(len(blocks))])]
        shuffled.append(float(grow(target).score(x, target)))
    if real < np.quantile(shuffled, 0.95):
        return None
    return _rule(tree, names, switches)


def _rule(  # type: ignore[no-untyped-def]
    tree, names: Sequence[str], switches: Collection[str]
) -> str | None:
    """The path to the leaf with most heat: for each variable the tightest bounds."""
    t = tree.tree_
    best = 0.0
    bounds: Bounds = {}

    def walk(node: int, path: Bounds) -> None:
        nonlocal best, bounds
        if t.children_left[node] < 0:
            value = abs(float(t.value[node].ravel()[0]))
            if value > best:
                best, bounds = value, path
            return
        name, edge = names[t.feature[node]], float(t.threshold[node])
        low, high = path.get(name, (-np.inf, np.inf))
        walk(t.children_left[node], {**path, name: (low, min(high, edge))})
        walk(t.children_right[node], {**path, name: (max(low, edge), high)})

    walk(0, {})
    return " and ".join(_said(name, *ends, name in switches) for name, ends in bounds.items()) or None


def _said(name: str, low: float, high: float, is_switch: bool) -> str:
    """One condition of a rule, as an expression of a model file would have it. Of a switch the tree sees the
    share of a span that it was on: one says that it was on, or off.
    """
    if is_switch and not (low > -np.inf and high < np.inf):
        low, high = (0.5, high) if low > -np.inf else (low, 0.5)
    above = [f"{name} > {low:.4g}"] if low > -np.inf else []
    return " and ".join([*above, *([f"{name} <= {high:.4g}"] if high < np.inf else [])])
