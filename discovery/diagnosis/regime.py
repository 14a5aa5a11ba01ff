"""The regime in which heat is missing: a rule over inputs and states, written as an expression of a model
file.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis.scored import Scored
from discovery.diagnosis.tree import Tree, grown
from discovery.dynamics import Trajectory
from discovery.dynamics.system import shifted
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.latent_force import Force
from discovery.models import Model
from discovery.terms import evaluate

Array = NDArray[np.float64]

Bounds = dict[str, tuple[float, float]]  # of a variable: above, and up to

ACTS = 0.02  # of the 95th percentile of its heat, above which an effect acts
MOST = 4000  # instants of a recording that a rule is grown on
HOLDS = 0.9  # share of a rule's instants at which the heat acts, of the others at which it does not, and of
# the heat that lies within


def of_effects(best: Scored, effects: Sequence[Hypothesis], baseline: Model) -> str | None:
    """When the lasting effects of an answer act, in terms of the inputs and states of the baseline; None if
    they always act, or if no rule of two conditions describes it.
    """
    x: list[Array] = []
    heat: list[Array] = []
    names: list[str] = []
    for trajectory in map(_as_stamped, best.fit.trajectories):
        ends = trajectory.at_ends()
        known = {*trajectory.system.grid.nodes, *(n for n, s in baseline.states.items() if not s.memory)}
        names = [name for name in ends if name in known and name != "time" and np.ndim(ends[name])]
        every = -(-len(trajectory.system.grid.step) * 2 // MOST)
        x.append(np.column_stack([np.asarray(ends[name]) for name in names])[::every])
        heat.append(np.array([np.abs(heat_of(best, trajectory, h)) for h in effects])[:, ::every])
    features, flows = np.concatenate(x), np.concatenate(heat, axis=1)
    usual = np.percentile(flows, 95, axis=1)[:, None]
    acts = (flows > ACTS * usual).any(axis=0).astype(float)
    if not 0.0 < acts.mean() < 1.0:
        return None
    # heats of several effects count by their own usual size
    shares = (flows / np.maximum(usual, 1e-300)).sum(axis=0)
    for conditions in (1, 2):  # the plainest that holds
        bounds = _path(_tree(features, acts, len(acts) // 50, conditions), names)
        within = np.ones(len(acts), bool)
        for name, (low, high) in bounds.items():
            column = features[:, names.index(name)]
            within &= (column > low) & (column <= high)
        if within.all() or shares[within].sum() < HOLDS * shares.sum():
            continue
        if acts[within].mean() >= HOLDS and acts[~within].mean() <= 1 - HOLDS:
            return _rule(bounds, _switches(features, names))
    return None


def of_free_heat(baseline: Scored, f: Force, seed: int = 0) -> str | None:
    """When heat of unknown cause acts; None if no rule of two conditions describes it.

    The tree must beat 95 % of trees grown on heat whose days were shuffled.
    """
    x: list[Array] = []
    names: list[str] = []
    switches: set[str] | None = None
    for trajectory in baseline.fit.trajectories:
        nodes = {k: v for k, v in trajectory.at_nodes().items() if np.ndim(v) and k != "time"}
        time, edges = trajectory.system.grid.time, f.edges[trajectory.system.grid.recording]
        names, values = list(nodes), np.column_stack([np.asarray(v) for v in nodes.values()])
        block = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
        counts = np.maximum(np.bincount(block, minlength=len(edges) - 1), 1)
        x.append(np.column_stack([np.bincount(block, v, len(edges) - 1) / counts for v in values.T]))
        own = _switches(values, names)
        switches = own if switches is None else switches & own
    features = np.concatenate(x)
    heat = np.concatenate([f.heat[t.system.grid.recording] for t in baseline.fit.trajectories])
    moving = np.ptp(features, axis=0) > 1e-9
    features, names = features[:, moving], [n for n, m in zip(names, moving, strict=True) if m]
    if not names or np.ptp(heat) == 0:
        return None
    least = max(6, len(heat) // 12)
    tree = _tree(features, heat, least)
    rng = np.random.default_rng(seed)
    size = 12
    blocks = [np.arange(i, min(i + size, len(heat))) for i in range(0, len(heat), size)]
    shuffled = []
    for _ in range(40):
        target = heat[np.concatenate([blocks[i] for i in rng.permutation(len(blocks))])]
        shuffled.append(float(_tree(features, target, least).score(features, target)))
    if float(tree.score(features, heat)) < np.quantile(shuffled, 0.95):
        return None
    return _rule(_path(tree, names), switches or set())


def _as_stamped(run: Trajectory) -> Trajectory:
    """A run with its inputs as their stamps say: a switch that comes late is a part of itself for a step."""
    return replace(run, system=shifted(run.system, run.system.grid.offset))


def heat_of(best: Scored, trajectory: Trajectory, h: Hypothesis, body: str = "") -> Array:
    """Heat flow of an effect into a body (default: its first; all bodies if it has none) at the ends of the
    steps (2 K,), W or rate.
    """
    body = body or (h.states[0] if h.states else "")
    heat = np.zeros(2 * len(trajectory.system.grid.step))
    env: Mapping[str, Array | float] = {
        **trajectory.at_ends(),
        **best.model.values(trajectory.system.grid.recording),
    }
    for term in h.terms:
        if not body or term.into == body:
            flow = evaluate(term.expression, env, memory=trajectory.system.ends).value
            heat = heat + np.broadcast_to(flow, heat.shape)
    return heat


def _tree(x: Array, target: Array, least: int, depth: int = 2) -> Tree:
    return grown(x, target, max(least, 1), depth)


def _switches(x: Array, names: Sequence[str]) -> set[str]:
    """Variables that are only on or off."""
    return {name for name, column in zip(names, x.T, strict=True) if np.isin(column, (0.0, 1.0)).all()}


def _path(tree: Tree, names: Sequence[str]) -> Bounds:
    """The path to the leaf with most heat: for each variable the tightest bounds."""
    best = 0.0
    bounds: Bounds = {}

    def walk(node: Tree, path: Bounds) -> None:
        nonlocal best, bounds
        if node.below is None or node.above is None:
            if abs(node.value) > best:
                best, bounds = abs(node.value), path
            return
        name, edge = names[node.feature], node.edge
        low, high = path.get(name, (-np.inf, np.inf))
        walk(node.below, {**path, name: (low, min(high, edge))})
        walk(node.above, {**path, name: (max(low, edge), high)})

    walk(tree, {})
    return bounds


def _rule(bounds: Bounds, switches: Collection[str]) -> str | None:
    return " and ".join(_said(name, *ends, name in switches) for name, ends in bounds.items()) or None


def _said(name: str, low: float, high: float, is_switch: bool) -> str:
    """One condition of a rule. Of a switch the tree sees the share of a span that it was on: one says that it
    was on, or off.
    """
    if is_switch and not (low > -np.inf and high < np.inf):
        low, high = (0.5, high) if low > -np.inf else (low, 0.5)
    above = [f"{name} > {low:.4g}"] if low > -np.inf else []
    return " and ".join([*above, *([f"{name} <= {high:.4g}"] if high < np.inf else [])])
