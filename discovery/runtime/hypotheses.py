"""What new recordings say of a model at work: nothing, wear, a faulty input sensor, new physics, or something
else.

All are hypotheses of one comparison (`changes.py`). Under `nothing` the parameters and laws are as uncertain
as their fit left them. Under `wear` the parameters that can age have changed, under `sensor of X` this sensor
has an offset. `new physics` is an effect of the catalogue that began to act (`newphysics.py`), named as in a
diagnosis, or another exchange with one temperature (a fan, a door). `something else` is heat of unknown cause
at one body, as in the diagnosis, or from one body to another. In the running loop, an input that the
model does not use may act by a path of its own, or one that came in so acts no longer (`unused.py`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis.thresholds import UNKNOWN_HEAT, UNKNOWN_SHARES
from discovery.errors import UserError
from discovery.evidence.bayes import Score
from discovery.export.document import Exported
from discovery.export.guessed import at_readings
from discovery.export.knowledge import problem_of, read_knowledge, settle_starts
from discovery.export.trend import DAY_S
from discovery.fitting.covariance import Z95
from discovery.fitting.problem import Problem
from discovery.models import Model
from discovery.printed import counted
from discovery.recordings import Campaign
from discovery.runtime.changes import Change, Seen, Table, make_table
from discovery.runtime.newphysics import new_physics
from discovery.runtime.unseen import unseen
from discovery.runtime.unused import Path, path_columns, paths, taken_in
from discovery.runtime.verdict import (
    NOTHING,
    RARE,
    SOMETHING_ELSE,
    WEAR,
    Explanation,
    Verdict,
    before,
    explains_all,
    probability,
    verdict_of,
)
from discovery.runtime.wear import ageing, uses, usual_wear, wears
from discovery.terms import Apply, Expression, Name, names, parse
from discovery.threads import one_thread

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
# Chosen on seeds set aside for it and confirmed on others, see benchmarks/runtime.md
OTHER = (0.1, 0.4)  # relative change of a parameter that cannot age: something else changed
OFFSET = (0.5, 2.0)  # K, of the sensor of an input
ACTS = (1.0, 4.0)  # residuals of the fit that an unused input shows
MEMORY_S = 24 * 3600.0  # in which a residual counts less and less: wear goes on meanwhile
START_SD = 0.5  # K, um: of states that are known where a recording begins
OTHERS = ("something else", "exchange with")  # what may have changed together with wear or a sensor
TEMPERATURES = ("ambient temperature", "fluid temperature", "coolant temperature", "temperature")


@dataclass(frozen=True)
class Comparison:
    """What the recordings say. `odds`: log of the probability of the readings under each hypothesis over that
    under `nothing`, prior odds included. `verdict` and `what`: the best one, and the sensor where it is one.
    `rms`: residual of the model at work in units of that of its fit; `lately`: the same, as of now.
    `change`: of the parameters that age, under wear, with standard deviations; `during`: of it, what came
    during the recordings; `rows`: what is known after it. `path`: of the unused input, with its parameters.
    `physics`: effects of the catalogue that were fitted, by name; `probability`: of the verdict, where it is
    new physics. `share`: by which all exchange with a temperature changed, where it is that, to first order.
    `unseen`: sizes of changes that the readings may hide, where the verdict is `nothing`.
    """

    recordings: tuple[str, ...]
    readings: int
    verdict: Verdict
    what: str
    odds: Mapping[str, float]
    rms: float
    lately: float
    change: Mapping[str, tuple[float, float]]
    rows: Array
    path: tuple[Path, Mapping[str, float]] | None = None
    physics: Mapping[str, Score] = field(default_factory=dict)
    probability: float | None = None
    share: float | None = None
    during: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    unseen: Mapping[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        odds = {name: round(value, 1) + 0.0 for name, value in self.odds.items() if name != "nothing"}
        others = ", ".join(f"{name} {value:+.1f}" for name, value in odds.items())  # never "-0.0"
        what = f" ({self.what})" if self.what else ""
        return (
            f"{', '.join(self.recordings)}: {self.verdict}{what}; {counted(self.readings, 'reading')}, "
            f"residual {self.rms:.2f} times that of the fit; log odds against no change: {others}"
        )


@one_thread
def compare(
    exported: Exported,
    campaign: Campaign,
    recordings: Sequence[str],
    *,
    choose: bool = False,
    named: bool = True,
    begin: Mapping[str, float] | None = None,
    since: float | None = None,
) -> Comparison:
    """Compare the hypotheses on recordings taken since the last revision.

    Args:
        choose: a recorded input that the model does not use may act by a path of its own, too.
        named: effects of the catalogue may have begun; to try them all takes a minute.
        begin: states of the model where the recordings begin; default as they are read there.
        since: instant [s] where the recording begins, for a model that moves by date.

    Raises:
        UserError: a model without knowledge of its parameters, or no reading of any output.
    """
    known = read_knowledge(exported.model.name, exported.document["knowledge"])
    levels = {n: r for n, r in known.residual.items() if r is not None}
    outputs = [n for n in levels if any(_read(campaign, r, n) for r in recordings)]
    if not outputs:
        raise UserError(
            f"{campaign.path}: recording '{recordings[0]}' holds no reading of {', '.join(levels)}; "
            "there is nothing to learn from"
        )
    exported = begun(exported, campaign, recordings, begin)
    problem = problem_of(_moving(exported, since), campaign, recordings, outputs)
    channels = [i.name for i in exported.inputs if i.role in TEMPERATURES]
    ways = {str(p): p for p in paths(exported, campaign, recordings, outputs)} if choose else {}
    idle = taken_in(exported.model) if choose else {}
    columns = {name: path.columns for name, path in ways.items()}
    columns |= {channel: path_columns(problem, gains) for channel, gains in idle.items()}
    table = make_table(known, problem, channels, columns)
    worn = wears(exported, table)
    days = sum(float(system.grid.time[-1]) for system in problem.systems) / DAY_S
    usual = usual_wear(exported, table, known.worn, days)
    seen = table.seen(usual.change if usual else None)
    offered = {WEAR: [one.change for one in worn]}
    for name in channels:
        offered[Explanation("sensor of", name)] = [
            Change(table.at[name], np.array([[size]])) for size in OFFSET
        ]
    for name, path in ways.items():
        alike = offered.setdefault(Explanation("input", path.channel), [])
        alike.extend(_acting(path, table.at[name], levels))
    for name in channels:
        if exchanges := _exchanges(exported, table, name):
            offered[Explanation("exchange with", name)] = exchanges
    offered[SOMETHING_ELSE] = _heats(exported.model, table, known.floor)
    evidence = {one: _mean([seen.log_odds(c) for c in alike]) for one, alike in offered.items()}
    for channel, gains in idle.items():
        by = np.array([-exported.model.parameters[n].value for n in gains])
        evidence[Explanation("no input", channel)] = seen.log_odds_of(table.at[channel], by)
    odds = {NOTHING: 0.0} | {one: value + before(one, evidence) for one, value in evidence.items()}
    physics = new_physics(exported, known, campaign, recordings, outputs) if named else {}
    odds |= {Explanation("effect", n, one.hypothesis.effect.word): one.odds for n, one in physics.items()}
    verdict, what = verdict_of(odds, evidence)
    alone = table.seen()
    if usual and verdict == "nothing":
        verdict = "wear goes on"
    if verdict in ("wear", "input sensor"):
        explained = offered[WEAR if verdict == "wear" else Explanation("sensor of", what)]
        best = max(explained, key=seen.log_odds)
        others = [one for e, alike in offered.items() if e.kind in OTHERS for one in alike]
        also = _mean([seen.log_odds(best.and_also(other)) for other in others])
        verdict, what = explains_all(verdict, what, also - seen.log_odds(best) - RARE)
    new = next((one for one in odds if str(one) == what), None) if verdict == "new physics" else None
    most = max([*worn, usual] if usual else worn, key=lambda one: alone.log_odds(one.change))
    followed = table.followed(usual if usual and verdict == "wear goes on" else most)
    every = _by_name(exported, followed.by, followed.sd)
    change = {n: pair for n, pair in every.items() if pair[1] > 0.0}
    during = _by_name(exported, followed.during, followed.during_sd)
    chosen = _chosen(seen, table, [(n, p) for n, p in ways.items() if p.channel == what], levels)
    count = int(sum(np.isfinite(s.grid.readings).sum() for s in problem.systems))
    rms, lately = (_rms(problem, levels, outputs, memory) for memory in (np.inf, MEMORY_S))
    return Comparison(
        tuple(recordings),
        count,
        verdict,
        what,
        {str(one): value for one, value in odds.items()},
        rms,
        lately,
        change,
        followed.rows,
        chosen,
        physics,
        probability(odds, new) if new else None,
        _share(seen, offered[new]) if new in offered else None,
        {n: during[n] for n in change},
        unseen(exported, table, seen, offered, physics, OTHER[0]) if verdict == "nothing" else {},
    )


def residual_lately(
    exported: Exported,
    campaign: Campaign,
    recordings: Sequence[str],
    begin: Mapping[str, float] | None = None,
    since: float | None = None,
) -> float:
    """Residual of a model on recordings, as of now, in units of that of its fit; `begin` and `since`: see
    `compare`.
    """
    exported = begun(exported, campaign, recordings, begin)
    residual = exported.document["knowledge"]["residual"]
    levels = {n: r for n, r in residual.items() if r is not None}
    outputs = [n for n in levels if any(_read(campaign, r, n) for r in recordings)]
    problem = problem_of(_moving(exported, since), campaign, recordings, outputs)
    return _rms(problem, levels, outputs, MEMORY_S)


def _by_name(exported: Exported, by: Array, sd: Array) -> dict[str, tuple[float, float]]:
    """Changes (A,) of the parameters that age, with standard deviations (A,)."""
    return dict(zip(ageing(exported), zip(by.tolist(), sd.tolist(), strict=True), strict=True))


def _moving(exported: Exported, since: float | None) -> Model:
    """The model on a recording that begins at an instant, where that is known."""
    if exported.trend is None or since is None:
        return exported.model
    return exported.trend.moving(exported.model, since)


def _exchanges(exported: Exported, table: Table, channel: str) -> list[Change]:
    """All exchange with one temperature by the same share, where it does not age: a fan, a door."""
    model, old = exported.model, ageing(exported)
    formulas = [*(term.expression for term in model.terms), *model.outputs.values()]
    used = list(uses(exported))
    group = []
    for name in used:
        mine = [e for e in formulas if name in names(e)]
        alike = mine and all(channel in names(e) and _is_factor(name, e) for e in mine)
        if alike and name not in old and model.parameters[name].value:
            group.append(name)
    at = table.at["at once"][[used.index(name) for name in group]]
    sizes = np.array([[model.parameters[name].value] for name in group])
    return [Change(at, width * sizes) for width in OTHER] if group else []


def _is_factor(name: str, expression: Expression) -> bool:
    """Whether a formula is in proportion to a parameter.

    >>> _is_factor("h", parse("h*2*(T - body)")), _is_factor("t", parse("(T - body)/t"))
    (True, False)
    """
    if isinstance(expression, Apply) and expression.function == "*":
        return any(_is_factor(name, one) for one in expression.arguments)
    return expression == Name(name)


def _acting(path: Path, at: Ints, levels: Mapping[str, float]) -> list[Change]:
    """The path of an unused input, with parameters of some sizes: what they show is counted in residuals of
    the fit.
    """
    scale = np.array([levels[n] for n in path.into.values()]) / np.maximum(path.size, 1e-300)
    return [Change(at, np.diag(times * scale)) for times in ACTS]


def _chosen(
    seen: Seen, table: Table, ways: Sequence[tuple[str, Path]], levels: Mapping[str, float]
) -> tuple[Path, dict[str, float]] | None:
    """The most likely of some paths, with the values of its parameters."""
    acts = [(path, change) for name, path in ways for change in _acting(path, table.at[name], levels)]
    if not acts:
        return None
    path, change = max(acts, key=lambda one: seen.log_odds(one[1]))
    return path, dict(zip(path.into, seen.size(change)[0].tolist(), strict=True))


def _heats(model: Model, table: Table, floor: Mapping[str, float]) -> list[Change]:
    """Heat of unknown cause at one state, or from one body to another, of any size."""
    bodies = {name for term in model.terms if term.source for name in (term.into, term.source)}
    pairs = combinations([name for name in table.heat if name in bodies], 2)
    sizes = [(times, share) for times in UNKNOWN_HEAT for share in UNKNOWN_SHARES]
    alone = [table.heat[n].change(times * floor[n], share) for n in table.heat for times, share in sizes]
    between = [
        table.heat[a].flow_to(table.heat[b], times * min(floor[a], floor[b]), share)
        for a, b in pairs
        for times, share in sizes
    ]
    return alone + between


def _read(campaign: Campaign, recording: str, name: str) -> bool:
    values = campaign.recordings[recording].values
    return name in values and bool(np.isfinite(values[name]).any())


def _share(seen: Seen, changes: Sequence[Change]) -> float:
    """How far a change of one coefficient goes, as a share of what it is, to first order."""
    width, best = max(zip(OTHER, changes, strict=True), key=lambda one: seen.log_odds(one[1]))
    return float(width * seen.size(best)[0][0] / best.root[0, 0])


def _mean(logs: Sequence[float]) -> float:
    """Log of the mean of probabilities."""
    top = max(logs)
    return float(top + np.log(np.mean(np.exp(np.array(logs) - top))))


def _rms(problem: Problem, levels: Mapping[str, float], outputs: Sequence[str], memory: float) -> float:
    """Residual of the model at work, start values settled, in units of that of its fit; a reading counts less
    with its age over `memory` [s].
    """
    scale = np.array([levels[n] for n in outputs])
    after = sum(float(system.grid.time[-1]) for system in problem.systems)
    total, weight = 0.0, 0.0
    for run in settle_starts(problem, scale.tolist())[1]:
        grid = run.system.grid
        squares = (problem.residual(run) / scale) ** 2
        share = np.exp((grid.time[grid.read] - after) / memory)
        total += float(np.nansum(squares * share[:, None]))
        weight += float(np.sum(np.isfinite(squares) * share[:, None]))
        after -= float(grid.time[-1])
    return float(np.sqrt(total / weight))


def begun(
    exported: Exported, campaign: Campaign, recordings: Sequence[str], states: Mapping[str, float] | None
) -> Exported:
    """The model as it starts from states that are known: those it had where the recording begins. Others keep
    their start. None: nothing is known but what is read there.
    """
    model = exported.model
    if states is None:
        return replace(exported, model=at_readings(model, campaign, recordings))
    started = {
        name: replace(state, start=parse(repr(float(states[name]))), start_sd=START_SD)
        if name in states
        else state
        for name, state in model.states.items()
    }
    return replace(exported, model=replace(model, states=started))


def model_with(model: Model, change: Mapping[str, tuple[float, float]]) -> Model:
    """The model with its parameters moved, within their bounds, with 95 % intervals."""
    parameters = dict(model.parameters)
    for name, (by, sd) in change.items():
        p = parameters[name]
        value = float(np.clip(p.value + by, p.min, p.max))
        low, high = max(value - Z95 * sd, p.min), min(value + Z95 * sd, p.max)
        parameters[name] = replace(p, value=value, low=low, high=high)
    return replace(model, parameters=parameters)
