"""Start values of first-order models from the readings alone, so that a fit converges without a guess.

With the time constants given, equations (7) to (9) are linear in everything else. So every input is filtered
through a grid of time constants once; the best combination is a small linear regression for each, and the
exact fit starts there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import make_grid, make_system, simulate
from discovery.models import Model, Parameter, State
from discovery.models.model import TIME_UNITS
from discovery.recordings import Campaign
from discovery.terms import Apply, Name, Number, Term, names, parse

Array = NDArray[np.float64]
_COUNT = 10  # time constants on the grid


@dataclass(frozen=True)
class _Part:
    """One state of the form dx/dt = pole x + sum gain (u + zero) + constant."""

    state: str
    pole: str
    gains: Mapping[str, str]  # input -> parameter
    zeros: Mapping[str, str]  # input -> parameter
    constant: str | None


def warm_start(model: Model, campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]) -> Model:
    """The model with start values from a regression on filtered inputs, and poles no slower than a third of
    the longest recording; unchanged where it is not of first-order parts.

    Args:
        recordings: recordings to fit; nothing else is looked at.
        outputs: errors, each a state or a sum of states of first order.
    """
    parts = _parts(model)
    if parts is None:
        return model
    inputs = sorted({u for part in parts.values() for u in part.gains})
    taus = _grid_of_times(campaign, recordings, outputs)
    banks = [_Bank.make(campaign, recording, inputs, outputs, taus) for recording in recordings]
    found: dict[str, float] = {}
    for y, output in enumerate(outputs):
        mine = [
            parts[name] for name in sorted(names(model.outputs.get(output, Name(output)))) if name in parts
        ]
        if mine:
            found |= _best(model, mine, banks, y, taus)
    model = _poles_within_reach(model, parts, float(taus[-1]), float(taus[0]))
    inside = {
        name: min(max(value, model.parameters[name].min), model.parameters[name].max)
        for name, value in found.items()
    }
    return model.with_values(inside)


def _poles_within_reach(model: Model, parts: Mapping[str, _Part], slowest: float, fastest: float) -> Model:
    """The model with no time constant beyond `slowest` or below `fastest` [s]. Beyond, an influence only adds
    up its input, fits every trend of these recordings and runs away in others; below, it follows its input
    within the distance of readings, however fast, and no controller can integrate it.
    """
    unit = TIME_UNITS[model.time_unit]
    poles = {part.pole: model.parameters[part.pole] for part in parts.values()}
    bounded = {
        name: replace(p, max=min(p.max, -unit / slowest), min=max(p.min, -unit / fastest))
        for name, p in poles.items()
    }
    return replace(model, parameters={**model.parameters, **bounded})


def _parts(model: Model) -> dict[str, _Part] | None:
    """The model's states as first-order parts; None when it has any other term."""
    inputs = set(model.inputs)
    parts = {name: _Part(name, "", {}, {}, None) for name in model.states}
    for term in model.terms:
        part = parts[term.into]
        match term.expression:
            case Apply("*", (Name(p), Name(x))) if x == term.into:
                part = replace(part, pole=p)
            case Apply("*", (Name(p), Name(u))) if u in inputs:
                part = replace(part, gains={**part.gains, u: p})
            case Apply("*", (Name(p), Apply("+", (Name(u), Name(z))))) if (
                u in inputs and z in model.parameters
            ):
                part = replace(part, gains={**part.gains, u: p}, zeros={**part.zeros, u: z})
            case Name(p) if p in model.parameters:
                part = replace(part, constant=p)
            case _:
                return None
        parts[term.into] = part
    return parts if all(part.pole for part in parts.values()) else None


def _grid_of_times(campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]) -> Array:
    """Time constants in s from a quarter of the distance of readings to a third of the longest recording."""
    spans, steps = [], []
    for recording in recordings:
        data = campaign.recordings[recording]
        taken = data.time[
            np.any([np.isfinite(data.values[name]) for name in outputs if name in data.values], axis=0)
        ]
        spans.append(float(np.ptp(data.time)))
        if len(taken) > 1:
            steps.append(float(np.median(np.diff(taken))))
    longest = max(spans)
    shortest = min(max(min(steps, default=longest / 100) / 4, longest / 2000), longest / 10)
    return np.geomspace(shortest, longest / 3, _COUNT)


@dataclass(frozen=True)
class _Bank:
    """Inputs of a recording filtered with unit gain from rest, at the readings."""

    filtered: Mapping[str, Array]  # input -> (taus, R)
    decay: Array  # (taus, R), what is left of a start value
    readings: Array  # (R, Y)

    @staticmethod
    def make(
        campaign: Campaign, recording: str, inputs: Sequence[str], outputs: Sequence[str], taus: Array
    ) -> _Bank:
        grid = make_grid(campaign, recording, inputs, outputs)
        filtered = {}
        for u in inputs:
            states = {"x": State("x", "", None, Number(0.0), 0.0)}
            terms = (Term("follow", "x", parse(f"({u} - x)/tau")),)
            system = make_system(
                Model("filter", {"tau": Parameter(1.0)}, states, terms, {}),
                grid.part(outputs=()),
            )
            filtered[u] = np.array([simulate(system, {"tau": tau}).x[grid.read, 0] for tau in taus])
        since = grid.time[grid.read] - grid.time[0]
        return _Bank(filtered, np.exp(-since[None, :] / taus[:, None]), grid.readings)


def _best(
    model: Model, parts: Sequence[_Part], banks: Sequence[_Bank], y: int, taus: Array
) -> dict[str, float]:
    """Parameter values of the best combination of time constants for one output."""
    reading = np.concatenate([bank.readings[:, y] for bank in banks])
    seen = np.isfinite(reading)
    target = reading[seen]

    def columns(chosen: Sequence[int]) -> Array:
        out = []
        for part, k in zip(parts, chosen, strict=True):
            for u in part.gains:
                shift = model.parameters[part.zeros[u]].value if u in part.zeros else 0.0
                out.append(
                    np.concatenate([bank.filtered[u][k] + shift * (1 - bank.decay[k]) for bank in banks])
                )
        first = chosen[0]
        out.append(np.concatenate([1 - bank.decay[first] for bank in banks]))
        for start in range(len(banks)):  # each recording starts somewhere
            out += [np.concatenate([bank.decay[first] * (i == start) for i, bank in enumerate(banks)])]
        return np.asarray(np.column_stack(out)[seen])

    def misfit(chosen: Sequence[int]) -> tuple[float, Array]:
        x = columns(chosen)
        size = np.maximum(np.linalg.norm(x, axis=0), 1e-12)
        a = x / size
        solved = np.linalg.solve(a.T @ a + 1e-8 * np.eye(a.shape[1]), a.T @ target)
        rest = target - a @ solved
        return float(rest @ rest), solved / size

    best = min(product(range(len(taus)), repeat=len(parts)), key=lambda chosen: misfit(chosen)[0])
    solved = list(misfit(best)[1])
    hour = TIME_UNITS[model.time_unit]
    found: dict[str, float] = {}
    for part, k in zip(parts, best, strict=True):
        rate = hour / float(taus[k])
        found[part.pole] = -rate
        for parameter in part.gains.values():
            found[parameter] = rate * float(solved.pop(0))
    constant = float(solved[0]) * hour / float(taus[best[0]])
    return found | _zero(model, parts[0], found, constant)


def _zero(model: Model, part: _Part, found: Mapping[str, float], constant: float) -> dict[str, float]:
    """Where the constant rate goes: a parameter of its own, else the zero balance of the first input."""
    if part.constant:
        return {part.constant: constant}
    for u, zero in part.zeros.items():
        gain = found[part.gains[u]]
        if not model.parameters[zero].fixed and abs(gain) > 1e-12:
            return {zero: model.parameters[zero].value + constant / gain}
    return {}
