"""Discovery of terms of measured temperatures: a body behind each sensor, all bodies together."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign
from discovery.sparse.bymasses import CLEAR
from discovery.sparse.byrates import discover_rates
from discovery.sparse.constraints import kept
from discovery.sparse.discovery import Discovery
from discovery.sparse.drives import AMBIENT, Inputs
from discovery.sparse.families import candidates
from discovery.sparse.options import SparseOptions
from discovery.sparse.ratedata import RateData, make_rate_data, nearer
from discovery.sparse.rates import Candidate, refit, with_candidates, without, without_idle
from discovery.sparse.starts import started
from discovery.terms import Name, Term, parse, text

LABORATORY = ("linear", "wet", "coupling", "radiation", "load", "second mass")
# s, time constants of the masses behind each body: two of a series in steps of four, in proportion to the
# recordings, of which the slower one shall see the sixth part
SECOND_MASS, _STEP, _SEEN = (300.0, 1200.0), 4.0, 6.0
SENSOR_LAG = (1.0, 20.0, 300.0)  # s: least, start, most
START_SD = 5.0  # K: a first reading may be an artefact of switching on


def discover_temperatures(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    options: SparseOptions,
) -> Discovery:
    """Choose the terms that move bodies behind sensors, and fit their numbers.

    The time constants of the masses behind them are those of a list while terms are chosen, then free. Masses
    begin as far from the first reading in every recording, so that free runs of others begin there, too.
    """
    room, states = _room(outputs, inputs, len(recordings))
    longest = max(float(campaign.recordings[r].time[-1]) for r in recordings)
    masses = second_masses(longest) if "second mass" in (options.library or LABORATORY) else ()
    least, lag, most = (min(t, longest / 4) for t in SENSOR_LAG)
    parameters, terms = {}, []
    bodies = [f"{name}_body" for name in outputs]
    for name, body in zip(outputs, bodies, strict=True):
        parameters[f"{name}_lag"] = Parameter(lag, "s", least, most)
        states[name] = State(name, "degC", None, None, START_SD, 1.0)
        terms.append(Term(f"sensor {name} follows", name, parse(f"({body} - {name})/{name}_lag")))
        states[body] = State(body, "degC", None, Name(name), START_SD, 1 / 3600)
    air = inputs.of(AMBIENT)[:1]
    for source, start in [*zip(bodies, outputs, strict=True), *((one, one) for one in air)]:
        for k, tau in enumerate(masses, start=1):  # what is behind a body, or between it and the air: a wall
            mass = f"{source}_mass{k}"
            parameters[f"{mass}_off"] = Parameter(0.0, "K", prior=(0.0, START_SD))
            parameters[f"{mass}_tau"] = Parameter(tau, "s", tau / _STEP, tau * _STEP, fixed=True)
            states[mass] = State(mass, "degC", None, parse(f"{start} + {mass}_off"), 0.0, 1.0)
            terms.append(Term(f"{mass} follows", mass, parse(f"({source} - {mass})/{mass}_tau")))
    empty = Model("temperatures", parameters, states, tuple(terms), {}, "h")
    words = options.library or LABORATORY
    own = [Candidate(body, parse(f"{room} - {body}"), 0.0) for body in bodies]
    given = candidates(bodies, empty, campaign, inputs, words, options, room)
    offered = [*own, *(c for c in given if (c.into, c.label) not in {(o.into, o.label) for o in own})]
    data = make_rate_data(campaign, recordings, outputs, inputs.names, options.blocks)
    channel, known = dict(zip(bodies, outputs, strict=True)), {room: inputs.reference}
    loads = inputs.of("heat load", "cooling power") or inputs.of("rotation speed", "other input")
    simple = {text(o.expression) for o in own} | set(loads)
    basis = [c for c in offered if c.label in simple]
    cautious = {(c.into, c.label): c for c in started(basis, data, channel, known)}
    begun = started(offered, data, channel, known)
    model, labels = with_candidates(empty, begun)
    slow, _ = with_candidates(
        empty, [cautious.get((c.into, c.label), replace(c, start=0.0)) for c in offered]
    )
    decay = [n for n, label in labels.items() if label.endswith(f": {room} - {label.split(': ')[0]}")]
    plain = [n for n, label in labels.items() if label.split(": ", 1)[1] in simple]
    first = {"1", *simple, *(text(parse(f"{a} - {b}")) for a in bodies for b in bodies if a != b)}
    easy = [n for n, label in labels.items() if label.split(": ", 1)[1] in first]
    always = [*decay, *kept(labels, options, campaign.path)]
    found = discover_rates(data, nearer(data, model, slow), labels, always, options, plain=plain, easy=easy)
    model = _timed(data, without_idle(found.model, outputs), [n for n in labels if n not in always])
    gone = {label for n, label in labels.items() if n in found.model.parameters and n not in model.parameters}
    left = [label for label in found.report["kept"] if label not in gone]
    terms = found.report["terms"] - len(found.report["kept"]) + len(left)
    return replace(found, model=model, report=found.report | {"kept": left, "terms": terms})


def _timed(data: RateData, model: Model, leaving: Collection[str]) -> Model:
    """The model with free time constants of its masses, without terms whose coefficient may then be zero.

    Args:
        leaving: coefficients that may leave.
    """
    free = {
        n: replace(p, fixed=False) if p.fixed and n.endswith("_tau") else p
        for n, p in model.parameters.items()
    }
    model = replace(model, parameters=free)
    while any("_mass" in name for name in model.states):
        fit = refit(model, data.campaign, data.recordings, data.outputs, {}, data.grids)
        unknowns = zip(fit.problem.unknowns, fit.standard_errors, strict=True)
        errors = {u.name: error for u, error in unknowns if not u.is_nuisance}
        strength = {
            n: abs(fit.model.parameters[n].value) / max(errors[n], 1e-300) for n in model.free if n in leaving
        }
        weakest = min(strength, key=lambda n: strength[n])
        if strength[weakest] >= CLEAR:
            return fit.model
        model = without_idle(without(fit.model, [weakest]), data.outputs)
    return model


def _room(outputs: Sequence[str], inputs: Inputs, count: int) -> tuple[str, dict[str, State]]:
    """The temperature of the room: its channel where it moves, else a constant of each of `count` recordings.

    Sensors that start near the known temperature of the room are at rest in it, and their mean is the room's
    temperature of that day. A single recording does not separate it from steady heat: its readings would
    pull it away from where free runs begin, which see only the first reading.
    """
    if air := inputs.of(AMBIENT):
        return air[0], {}
    mean = f"({' + '.join(outputs)})/{len(outputs)}"
    start = parse(f"where({mean} < {inputs.reference + 2:g}, {mean}, {inputs.reference:g})")
    return "room", {"room": State("room", "degC", None, start, 0.5 if count > 1 else 0.1, 1 / 3600)}


def second_masses(longest: float) -> tuple[float, ...]:
    """Time constants [s] of the masses behind a body that recordings of this length [s] can show.

    >>> second_masses(7200.0), second_masses(86400.0)
    ((300.0, 1200.0), (4800.0, 19200.0))
    """
    slower = max(longest, 1.0) / _SEEN / SECOND_MASS[-1]
    scale = _STEP ** round(float(np.log(slower) / np.log(_STEP)))
    return tuple(tau * scale for tau in SECOND_MASS)
