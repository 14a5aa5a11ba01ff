"""What stands behind a measured output: its own state alone, its rate as a hidden state, or a body that
empties into it.

    own        y' = sum of terms in y and the inputs
    rate       y' = v,  v' = sum of terms in y, v and the inputs            a mass on a spring
    upstream   y' = flow(h) - flow(y),  h' = terms in the inputs - flow(h)  a tank above a tank

The flow out of the upstream body enters the output. This fixes the scale of the hidden state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from discovery.fitting.noise import roughness
from discovery.models import Model, Parameter, State
from discovery.models.model import TIME_UNITS
from discovery.sparse.laws import LAWS, laws, products
from discovery.sparse.options import FAMILIES
from discovery.sparse.ratedata import RateData
from discovery.sparse.rates import Candidate
from discovery.terms import Name, Number, Term, evaluate, names, parse, substitute

Array = NDArray[np.float64]

FLOWS = ("linear", "sqrt")  # laws from which a chain of two bodies begins
WORDS = ("linear", "square", "cubic", "drag", "sqrt", "sign", "abs")
FREE, UP, DOWN = (-np.inf, np.inf), (0.0, np.inf), (-np.inf, 0.0)
FINER = 10.0  # times the distance of two readings: quicker rates look like steps
_FINEST, _FINE = 1e-3, 0.02  # width of a step, as a share of the spread of its variable
REST = 0.1  # spread of the start of a hidden state, as a share of its size


@dataclass(frozen=True)
class Structure:
    """A model without its library, the library, and the names that the weak form uses."""

    word: str
    model: Model
    candidates: tuple[Candidate, ...]
    order: int = 1  # of the derivative that the library makes
    rates: Mapping[str, str] = field(default_factory=dict)  # of outputs, where these are hidden states


def own(data: RateData, outputs: Sequence[str], words: Sequence[str], unit: str, stable: bool) -> Structure:
    """Terms in the rates of the outputs themselves."""
    states = {y: _measured(data, y, unit) for y in outputs}
    inputs = _inputs(data, outputs)
    found = []
    for y in outputs:
        others = [o for o in outputs if o != y and "coupling" in words]
        found += _driven(data, y, outputs, words)
        found += [Candidate(y, parse(one)) for o in others for one in _laws(data, words, o)]
        found += [_law(y, y, one, stable) for one in _laws(data, words, y)]
        found += [Candidate(y, parse(one)) for one in products(words, [*outputs, *inputs])]
        found += _expressions(data, words, y, {"y": y}, outputs)
    return Structure("own", Model("own", {}, states, (), {}, unit), tuple(found))


def rate(data: RateData, outputs: Sequence[str], words: Sequence[str], unit: str, stable: bool) -> Structure:
    """Terms in the second derivatives of outputs. What couples two of them, as a spring between two masses
    does, follows their difference.
    """
    per, inputs = 1.0 / TIME_UNITS[unit], _inputs(data, outputs)
    rates = {y: f"{y}_rate" for y in outputs}
    states, terms, found = {}, [], []
    for y, v in rates.items():
        speed = _moving(data, y) / per or 1.0
        states[y] = _measured(data, y, unit)
        # a recording may begin in the middle of a motion
        states[v] = State(v, f"{states[y].unit}/{unit}", None, Number(0.0), speed, per)
        terms.append(Term(f"{v} moves {y}", y, parse(v)))
        found += _driven(data, v, outputs, words)
        found += [_law(v, y, one, stable) for one in _laws(data, words, y)]
        found += [
            _law(v, v, one, stable)
            for one in laws([w for w in words if w not in ("sqrt", "square")], v, width=_FINE * speed)
        ]
        others = [o for o in outputs if o != y and "coupling" in words]
        for o in others:
            found += [Candidate(v, parse(one)) for one in (o, rates[o])]
            bent = laws([w for w in words if w in ("cubic", "drag")], f"({o} - {y})")
            found += [Candidate(v, parse(one)) for one in bent]
        found += [Candidate(v, parse(one)) for one in products(words, [*outputs, v, *inputs])]
        found += _expressions(data, words, v, {"y": y, "rate": v}, outputs)
    return Structure("rate", Model("rate", {}, states, tuple(terms), {}, unit), tuple(found), 2, rates)


def upstream(
    data: RateData, output: str, words: Sequence[str], unit: str, level: Array | None = None
) -> Structure:
    """Flows out of a hidden body into an output, and out of the output; each may overflow beyond a level.

    Args:
        level: values that the hidden state takes, where a first fit knows them.
    """
    h, start = f"{output}_up", f"{output}_up_start"
    measured = _measured(data, output, unit)
    seen = _seen(data, output)
    states = {
        output: measured,
        h: State(h, measured.unit, None, parse(start), REST * float(np.std(seen)), 1.0 / TIME_UNITS[unit]),
    }
    known = seen if level is None else level
    wide = float(np.ptp(known))  # where no reading shows the start, it is near its values
    low, high = float(known.min()) - wide, float(known.max()) + wide
    parameters = {start: Parameter(float(known[0]), measured.unit, low, high)}
    words = [word for word in words if word != "sign"]  # what flows out of a body does not jump
    found = _driven(data, h, [output], words)
    most = quickest(data, unit)
    found += [_flow(output, one, most, h) for one in laws(words, h, level, hidden=True)]
    found += [_flow(output, one, most) for one in laws(words, output, seen)]
    found += [_flow(h, one, most) for one in laws([w for w in words if w == "threshold"], h, level)]
    found += _expressions(data, words, output, {"y": output, "up": h}, [output])
    return Structure("upstream", Model("upstream", parameters, states, (), {}, unit), tuple(found))


def balanced(data: RateData, chain: Structure, first: float, then: float) -> dict[int, float]:
    """Coefficients of a chain of one law by the time constants [s] of its two bodies.

    A law f has the slope 1/tau over the spread of the readings; all inputs together move what flows out by as
    much as the readings move it.
    """
    y = data.outputs[0]
    unit = TIME_UNITS[chain.model.time_unit]
    seen = _seen(data, y)
    spread = float(np.std(seen)) or 1.0
    samples = {n: s.value for g in data.grids.values() for n, s in g.samples.items()}
    inputs = _inputs(data, [y])
    found = {}
    for i, c in enumerate(chain.candidates):
        if c.label in inputs:
            moved = float(np.std(samples[c.label])) or 1.0
            found[i] = spread * unit / then / moved / len(inputs)
        elif c.label != "1":
            used = next(iter(names(c.expression)))
            law = np.broadcast_to(evaluate(c.expression, {used: seen}).value, seen.shape)
            slope = float(np.std(law)) / spread or 1.0
            found[i] = unit / first / slope if c.source else -unit / then / slope
    return found


def quickest(data: RateData, unit: str) -> float:
    """Largest rate constant [1/unit] that readings can show: from a tenth of their distance."""
    steps = [float(np.median(np.diff(g.time[g.read]))) for g in data.grids.values() if len(g.read) > 1]
    return FINER * TIME_UNITS[unit] / min(steps)


def _driven(data: RateData, into: str, outputs: Sequence[str], words: Sequence[str]) -> list[Candidate]:
    """The inputs and a constant, which a library that names any law of a state offers as well."""
    if not any(w in LAWS or w == "threshold" for w in words):
        return []
    return [Candidate(into, parse(u)) for u in ("1", *_inputs(data, outputs))]


def _flow(into: str, law: str, most: float, source: str | None = None) -> Candidate:
    """A flow into a state and out of its source, or out of the state."""
    return Candidate(into, parse(law), 0.0 if source else -most, most if source else 0.0, source=source)


def _law(into: str, variable: str, law: str, stable: bool) -> Candidate:
    """A law of a state; its linear part draws it back where the model must be stable."""
    return Candidate(into, parse(law), *(DOWN if stable and law == variable else FREE))


def _expressions(
    data: RateData, words: Sequence[str], into: str, aliases: Mapping[str, str], outputs: Sequence[str]
) -> list[Candidate]:
    """Expressions of the user that this form has all states of; `y`, `rate` and `up` are states."""
    states = {alias: Name(name) for alias, name in aliases.items()}
    known = {*states, *outputs, *_inputs(data, outputs), "time"}
    own = [parse(word, "library of the discovery") for word in words if word not in FAMILIES]
    return [Candidate(into, substitute(one, states)) for one in own if names(one) <= known]


def _measured(data: RateData, output: str, unit: str) -> State:
    """An output as a state that starts at its first reading."""
    return State(output, data.campaign.channels[output].unit, scale=1.0 / TIME_UNITS[unit])


def _inputs(data: RateData, outputs: Sequence[str]) -> list[str]:
    return [name for name in next(iter(data.grids.values())).samples if name not in outputs]


def _laws(data: RateData, words: Sequence[str], output: str) -> list[str]:
    """Laws of an output; a step in one is as wide as the readings cannot show."""
    column, seen = data.outputs.index(output), _seen(data, output)
    rough = roughness([data.grids[r].readings[:, column] for r in data.recordings])
    width = float(np.clip(rough, _FINEST * np.std(seen), _FINE * np.std(seen))) or 1.0
    return laws(words, output, seen, width=width)


def _moving(data: RateData, output: str) -> float:
    """How fast [1/s] an output moves: the largest rms of its differences over 1, 2, 4, ... readings, less
    their noise, over the time between them.
    """
    column = data.outputs.index(output)
    grids = [data.grids[r] for r in data.recordings]
    noise = 2 * roughness([g.readings[:, column] for g in grids]) ** 2
    found = 0.0
    for g in grids:
        known = np.isfinite(g.readings[:, column])
        time, y = g.time[g.read][known], g.readings[known, column]
        for lag in 2 ** np.arange(max(len(y), 1).bit_length() - 1):
            moved = float(np.mean((y[lag:] - y[:-lag]) ** 2)) - noise
            found = max(found, moved / float(np.mean(time[lag:] - time[:-lag])) ** 2)
    return float(np.sqrt(found))


def _seen(data: RateData, output: str) -> Array:
    column = data.outputs.index(output)
    series = np.concatenate([data.grids[r].readings[:, column] for r in data.recordings])
    return np.asarray(series[np.isfinite(series)])


def started(structure: Structure, coefficients: Mapping[int, float]) -> Structure:
    """The structure with start values of its candidates, by their place."""
    found = [
        replace(c, start=float(np.clip(coefficients.get(i, 0.0), c.low, c.high)))
        for i, c in enumerate(structure.candidates)
    ]
    return replace(structure, candidates=tuple(found))
