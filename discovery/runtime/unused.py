"""A recorded input that the model does not use comes in: a path of its own to each error, with a lag. One
that came in so and no longer helps is left out again.

    error += a (s - reference) + b,    tau ds/dt = X - s

It is one more kind of hypothesis of `hypotheses.py`; where it wins, the next revision of the model has this
input. The choice of inputs in the running loop follows Zimmermann et al., Adaptive input selection for
thermal error compensation models, CIRP Annals 69, 2020.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import sensitivities
from discovery.export.document import Exported
from discovery.export.knowledge import problem_of
from discovery.export.makedocument import described
from discovery.fitting.problem import Problem
from discovery.models import Model, Parameter, expanded
from discovery.models.model import with_settled_memories
from discovery.recordings import Campaign
from discovery.terms import Apply, Expression, names, parse, text

Array = NDArray[np.float64]

LAGS = (600.0, 3600.0, 4 * 3600.0)  # s, of the path
MOVES = 1e-6  # of its size, how much an input moves at least


@dataclass(frozen=True)
class Path:
    """A path of an unused input: `model` has it with gains and zeros of zero. `into`: the error that each of
    these parameters moves; `columns`: what the readings (R, Y, M) of each recording show more for a parameter
    of one.
    """

    channel: str
    lag: float
    model: Model
    into: Mapping[str, str]
    columns: tuple[Array, ...]

    def __str__(self) -> str:
        return f"{self.channel} after {self.lag:g} s"

    @property
    def size(self) -> Array:
        """(M,) rms of what the readings show more for one of each parameter."""
        own = np.concatenate([np.abs(c).max(axis=1) for c in self.columns])
        return np.asarray(np.sqrt(np.nanmean(own**2, axis=0)))


def unused_inputs(exported: Exported, campaign: Campaign, recordings: Sequence[str]) -> list[str]:
    """Channels that the model does not use, recorded in each recording, and that move in one of them."""
    known = {i.name for i in exported.inputs} | set(exported.model.outputs) | set(exported.model.states)
    found = []
    for name, channel in campaign.channels.items():
        if name in known or channel.role in ("error", "applied correction"):
            continue
        series = [campaign.recordings[r].values.get(name, np.array([np.nan])) for r in recordings]
        seen = [s[np.isfinite(s)] for s in series]
        if all(len(s) for s in seen) and any(np.ptp(s) > MOVES * (1.0 + np.abs(s).max()) for s in seen):
            found.append(name)
    return found


def paths(
    exported: Exported, campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]
) -> list[Path]:
    """Every path of every unused input."""
    found = []
    for name in unused_inputs(exported, campaign, recordings):
        for lag in LAGS:
            model, into = _with_path(exported.model, campaign, recordings, name, lag)
            into = {parameter: output for parameter, output in into.items() if output in outputs}
            problem = problem_of(model, campaign, recordings, outputs)
            found.append(Path(name, lag, model, into, path_columns(problem, list(into))))
    return found


def path_columns(problem: Problem, parameters: Sequence[str]) -> tuple[Array, ...]:
    """What the readings (R, Y, M) of each recording show more for one of each parameter of a path."""
    runs = [problem.run(system, problem.start) for system in problem.systems]
    return tuple(sensitivities(run, parameters) for run in runs)


def _with_path(
    model: Model, campaign: Campaign, recordings: Sequence[str], channel: str, lag: float
) -> tuple[Model, dict[str, str]]:
    series = np.concatenate([campaign.recordings[r].values[channel] for r in recordings])
    reference = float(np.nanmean(series))
    lagged = f"(lag({channel}, {channel}_lag) - {channel}_reference)"
    parameters, outputs, into = dict(model.parameters), dict(model.outputs), {}
    parameters[f"{channel}_lag"] = Parameter(lag, "s", fixed=True)
    parameters[f"{channel}_reference"] = Parameter(reference, fixed=True)
    for name, expression in model.outputs.items():
        if name in campaign.channels and campaign.channels[name].role == "error":
            gain, zero = f"{channel}_to_{name}", f"{channel}_zero_of_{name}"
            outputs[name] = parse(f"{text(expression)} + {gain}*{lagged} + {zero}")
            for parameter in (gain, zero):
                parameters[parameter], into[parameter] = Parameter(0.0), name
    longer = replace(model, outputs=outputs, parameters=parameters)
    return with_settled_memories(expanded(longer, campaign.channels)), into


def with_input(
    exported: Exported, campaign: Campaign, path: Path, values: Mapping[str, float]
) -> dict[str, Any]:
    """The document of the model with a path and the values of its parameters; what the fit knows stays."""
    parameters = path.model.with_values(values).parameters
    fixed = {n: replace(p, fixed=p.fixed or n in path.into) for n, p in parameters.items()}
    return _document(exported, campaign, replace(path.model, parameters=fixed))


def taken_in(model: Model) -> dict[str, list[str]]:
    """Inputs that came in by a path, each with the parameters of the path that move outputs."""
    channels = [n.removesuffix("_lag") for n in model.parameters if n.endswith("_lag")]
    ends = [*(f"_to_{n}" for n in model.outputs), *(f"_zero_of_{n}" for n in model.outputs)]
    found = {c: [c + end for end in ends if c + end in model.parameters] for c in channels}
    return {channel: names for channel, names in found.items() if names}


def without_input(exported: Exported, campaign: Campaign, channel: str) -> dict[str, Any]:
    """The document of the model without the path of an input."""
    model, gone = exported.model, set(taken_in(exported.model)[channel])
    outputs = {name: _without(e, gone) for name, e in model.outputs.items()}
    own = {*gone, f"{channel}_lag", f"{channel}_reference"}
    terms = tuple(term for term in model.terms if f"{channel}_lag" not in names(term.expression))
    fed = {term.into for term in model.terms} - {term.into for term in terms}
    states = {name: state for name, state in model.states.items() if name not in fed}
    parameters = {name: p for name, p in model.parameters.items() if name not in own}
    shorter = replace(model, outputs=outputs, terms=terms, states=states, parameters=parameters)
    return _document(exported, campaign, shorter)


def _without(expression: Expression, gone: Collection[str]) -> Expression:
    """A sum without its last summands that hold some names."""
    if isinstance(expression, Apply) and expression.function == "+":
        first, second = expression.arguments
        first = _without(first, gone)
        return first if names(second) & set(gone) else Apply("+", (first, second))
    return expression


def _document(exported: Exported, campaign: Campaign, model: Model) -> dict[str, Any]:
    """Return the document of a model. Known inputs and all outputs keep their ranges."""
    found = described(model, campaign, list(campaign.recordings))
    before = {i["name"]: i for i in exported.document["inputs"]}
    ranges = {o["name"]: o for o in exported.document["outputs"]}
    return {
        **exported.document,
        **found,
        "inputs": [before.get(i["name"], i) for i in found["inputs"]],
        "outputs": [{**ranges[name], "expression": text(e)} for name, e in model.outputs.items()],
    }
