"""A formula that describes missing heat if no effect of the catalogue fits. It is a description, not a cause.

SINDy in the filtered form. The library has powers, products, thresholds, saturations and lags of the inputs
and of the temperature of the body, and what opens or shuts there to the temperatures around it, each filtered
through the model. A temperature that is read counts as it was read: the model misses it. That it lags behind
itself would only say that heat is what warms the body. Evidence chooses one term after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import Scored
from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.dynamics.grid import interleaved
from discovery.evidence.bayes import project
from discovery.evidence.latent_force import Force
from discovery.models.model import shown_states
from discovery.terms import Expression, evaluate, parse

Array = NDArray[np.float64]

MOST_TERMS = 3
LIMITS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # quantiles at which something may begin
LAGS = (1 / 150, 1 / 40)  # of the longest recording: time constants of a description


@dataclass(frozen=True)
class Description:
    """A sum of terms that follows the missing heat at a body; `gain` is its log evidence."""

    state: str
    formula: str
    gain: float


@dataclass(frozen=True)
class Curve:
    """Missing heat against one input or state: bin centres, mean and standard error, in W (or rate)."""

    variable: str
    centre: tuple[float, ...]
    heat: tuple[float, ...]
    error: tuple[float, ...]


def describe(context: Context, current: Scored, force: Force) -> Description | None:
    """The best short formula for the heat of a force; None when no term adds evidence."""
    bodies = [_read(t, force.state) for t in current.fit.trajectories]
    library = _library(context, current, force.state, np.concatenate(bodies))
    setting = current.setting
    columns = []
    for trajectory, body in zip(current.fit.trajectories, bodies, strict=True):
        env = {**trajectory.at_ends(), force.state: interleaved(body[:-1], body[1:])}
        pieces = [
            Column(
                k,
                force.state,
                np.broadcast_to(
                    evaluate(e, env, memory=trajectory.system.ends).value,
                    (2 * len(trajectory.system.grid.step),),
                ),
            )
            for k, (_, e) in enumerate(library)
        ]
        columns.append(sensitivities(trajectory, (), (), pieces, count=len(library)))
    scale = np.array(
        [
            max(float(np.max(np.abs(np.concatenate([c[:, :, k].ravel() for c in columns])))), 1e-12)
            for k in range(len(library))
        ]
    )
    part = project(current.seen, setting, [c / scale for c in columns])
    gram, dot, count = part.block(range(len(library))), part.dot, len(part.columns)
    chosen: list[int] = []
    total = 0.0
    for _ in range(MOST_TERMS):
        best, gain = -1, total + 3.0
        for k in range(len(library)):
            if k in chosen:
                continue
            trial = _evidence(gram, dot, [*chosen, k], count)
            if trial > gain:
                best, gain = k, trial
        if best < 0:
            break
        chosen.append(best)
        total = gain
    if not chosen:
        return None
    weights = _solved(gram, dot, chosen) / scale[chosen]
    formula = " ".join(f"{w:+.4g}*{library[k][0]}" for w, k in zip(weights, chosen, strict=True))
    return Description(force.state, formula.removeprefix("+"), float(total))


def _solved(gram: Array, dot: Array, chosen: Sequence[int]) -> Array:
    return np.asarray(np.linalg.lstsq(gram[np.ix_(chosen, chosen)], dot[list(chosen)], rcond=1e-10)[0])


def _evidence(gram: Array, dot: Array, chosen: Sequence[int], count: int) -> float:
    """BIC-like log evidence of a linear model with a unit-information prior on `count` readings."""
    found = 0.5 * dot[list(chosen)] @ _solved(gram, dot, chosen)
    return float(found - 0.5 * len(chosen) * np.log(count))


def _read(run: Trajectory, state: str) -> Array:
    """A state at the nodes (T,): as its own sensor reads it, else as the model has it."""
    grid, series = run.system.grid, np.asarray(run.at_nodes()[state], dtype=float)
    output = shown_states(run.system.model, grid.outputs).get(state)
    if output is None:
        return series
    y = grid.outputs.index(output)
    seen = grid.measured[:, y]
    if not seen.any():
        return series
    missed = grid.readings[seen, y] - series[grid.read[seen]]
    return np.asarray(series + np.interp(grid.time, grid.time[grid.read[seen]], missed))


def _library(context: Context, current: Scored, state: str, body: Array) -> list[tuple[str, Expression]]:
    channels = [n for n in current.fit.trajectories[0].system.grid.samples if n in context.campaign.channels]
    nodes = current.fit.trajectories[0].at_nodes()
    moving = [n for n in channels if np.ptp(np.asarray(nodes[n])) > 1e-9]
    duration = max(float(grid.time[-1] - grid.time[0]) for grid in context.grids.values())
    slow = [f"{share * duration:.4g}" for share in LAGS]
    texts: list[str] = []
    for name in moving:
        series = np.concatenate(
            [np.asarray(t.at_nodes()[name], dtype=float) for t in current.fit.trajectories]
        )
        low, middle, high = (float(np.quantile(series, q)) for q in (0.25, 0.5, 0.75))
        temperature = "temperature" in context.campaign.channels[name].role
        base = f"({name} - {state})" if temperature else name
        texts += [base, f"{base}*abs({base})", *(f"lag({name}, {lag})" for lag in slow)]
        if high > low:
            texts += [
                f"max({name} - {middle:.4g}, 0)",
                f"min({name}, {middle:.4g})",
                f"({name} > {middle:.4g})",
            ]
        if not temperature:
            texts += [
                f"{name}*{state}",
                *(
                    f"{name}*{other}"
                    for other in moving
                    if other > name and "temperature" not in context.campaign.channels[other].role
                ),
            ]
            texts += [
                f"{name}*({other} - {state})"
                for other in moving
                if "temperature" in context.campaign.channels[other].role
            ]
    around = [n for n in moving if "temperature" in context.campaign.channels[n].role]
    for limit in np.quantile(body, LIMITS):
        texts += [f"max({state} - {limit:.4g}, 0)"]
        texts += [f"({state} > {limit:.4g})*({name} - {state})" for name in around]
    middle = float(np.median(body))
    texts += [f"abs({state} - {middle:.4g})*({state} - {middle:.4g})"]
    if state not in shown_states(current.fit.model, context.outputs):
        texts += [f"(lag({state}, {lag}) - {state})" for lag in slow]
    return [(text, parse(text)) for text in dict.fromkeys(texts)]


def curves(current: Scored, force: Force, bins: int = 8) -> list[Curve]:
    """The missing heat against every input and state, in bins of equal count, with standard errors."""
    values: dict[str, list[Array]] = {}
    heat, sd = [], []
    for trajectory in current.fit.trajectories:
        run = trajectory.system.grid.recording
        edges, time = force.edges[run], trajectory.system.grid.time
        block = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
        counts = np.maximum(np.bincount(block, minlength=len(edges) - 1), 1)
        for name, series in trajectory.at_nodes().items():
            if np.ndim(series) and name != "time":
                mean = np.bincount(block, np.asarray(series), minlength=len(edges) - 1) / counts
                values.setdefault(name, []).append(mean)
        heat.append(force.heat[run])
        sd.append(force.sd[run])
    y, error = np.concatenate(heat), np.concatenate(sd)
    found = []
    for name, parts in values.items():
        x = np.concatenate(parts)
        if np.ptp(x) < 1e-9:
            continue
        edges = np.unique(np.quantile(x, np.linspace(0, 1, bins + 1)))
        which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
        rows = [
            (
                float(x[m].mean()),
                float(y[m].mean()),
                float(np.sqrt(y[m].var() / m.sum() + (error[m] ** 2).mean() / m.sum())),
            )
            for b in range(len(edges) - 1)
            if (m := which == b).any()
        ]
        found.append(Curve(name, *zip(*rows, strict=True)))
    return found
