"""The first screen: the answer in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from discovery.printed import counted, when
from discovery.report.heat import diagnosed_key, subject
from discovery.report.lead import Lead, lead_over
from discovery.report.mismatch import NEAR, leads, sizes
from discovery.report.ranking import (
    astray,
    cells,
    is_error,
    origin,
    ranked,
    removed,
    rms_by_unit,
    rms_unit,
)
from discovery.report.recommended import recommended
from discovery.report.run import Run, pretty_unit
from discovery.report.text import listed, number, percent, words

_CLEARLY = 0.95  # ratio of two rms from which one is clearly smaller
_VERDICTS = {
    "no mismatch": "No missing physics was detected in",
    "missing physics": "Physics is missing in",
    "measurement fault": "A fault of the measurement, not missing physics, explains the mismatch of",
    "unexplained": "No effect of the catalogue explains the mismatch of",
}


@dataclass(frozen=True)
class Part:
    """`headline`: one sentence. `points`: what supports it. `figures`: (figure, caption), to show large."""

    headline: str = ""
    points: tuple[str, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Answer:
    """The main answer of a run, and the other one: what is missing, and which model predicts best."""

    first: Part
    second: Part


def answer(run: Run) -> Answer:
    """What the run says, in words and in few figures; missing physics comes first."""
    models, missing = _models(run), _missing(run)
    first = missing if leads(run) or not models.headline else models
    second = models if first is missing else missing
    return Answer(first, second)


def _models(run: Run) -> Part:
    """Which model predicts best, and how sure that is."""
    order = [model for model in ranked(run) if cells(run, model)]
    if not order:
        return Part()
    best = order[0]
    held_out = [r for r in run.held_out if r not in astray(run, best)]
    where = f"on {_called(held_out)}" if held_out else "on the recordings of the fit"
    named = f" “{best}”" if best != origin(run, best) else ""
    points, figures = _removed(run, best) if is_error(run) else _left(run, best)
    points = [one for one in (recommended(run, best),) if one] + points
    rivals = [m for m in order[1:] if astray(run, m) == astray(run, best)]
    found = {m: lead for m in rivals if (lead := lead_over(run, best, m)) is not None}
    for rival, lead in list(found.items())[:1]:
        points.append(
            f"Second best is {_name(run, rival)}: over all outputs, the rms of “{best}” is {_against(lead)}."
        )
    given = [m for m in found if origin(run, m) == "given"][:2]
    figures += [(_percent_less(found[m]), f"rms of {best} against {m}{_interval(found[m])}") for m in given]
    if is_error(run) and (worst := _worst(run, best)):
        points.append(worst)
    points += [
        f"The free run of “{model}” diverges on {_called(lost)}."
        for model in order
        if (lost := astray(run, model))
    ]
    if not run.held_out:
        points.append(
            "No recording was held out: these figures say how well the models fit, not how well they predict."
        )
    what = "predicts best" if order[1:] else "is the only one that was run"
    headline = f"The {origin(run, best)} model{named} {what} {where}."
    return Part(headline, tuple(points), tuple(figures))


def _against(lead: Lead) -> str:
    """A lead as words.

    >>> _against(Lead(0.9, 0.85, 0.96, 1.0)), _against(Lead(1.0, 1.0, 1.0, 0.0))
    ('10 % smaller (95 % interval: 4 to 15 %)', 'the same')
    >>> _against(Lead(0.97, 0.9, 1.05, 0.8))
    '3 % smaller (95 % interval: −5 to 10 %), so the recordings do not separate the two'
    """
    if 0.995 < lead.ratio < 1.005:
        said, sign = "the same", 1
    else:
        said, sign = (f"{100 * abs(lead.ratio - 1):.0f} % ", 1 if lead.ratio < 1 else -1)
        said += "smaller" if sign > 0 else "larger"
    if lead.low == lead.high:
        return said
    low, high = sorted(100 * sign * (1 - end) for end in (lead.low, lead.high))
    open_ = ", so the recordings do not separate the two" if lead.low <= 1 <= lead.high else ""
    return f"{said} (95 % interval: {low:.0f} to {high:.0f} %){open_}".replace("-", "−")


def _percent_less(lead: Lead) -> str:
    change = 100 * (lead.ratio - 1)
    return "0 %" if abs(change) < 0.5 else f"{'−' if change < 0 else '+'}{abs(change):.0f} %"


def _interval(lead: Lead) -> str:
    """Return the interval of a lead behind a caption. Without an interval, return nothing."""
    if lead.low == lead.high:
        return ""
    low, high = (f"{100 * (end - 1) + 0.0:.0f}".replace("-0", "0") for end in (lead.low, lead.high))
    return f" (95 %: {low} to {high} %)".replace("-", "−")


def _removed(run: Run, best: str) -> tuple[list[str], list[tuple[str, str]]]:
    """Say how much of the thermal error is gone. Without compensation, the error is the reading itself."""
    share = removed(run, best)
    if not math.isfinite(share):
        return [], []
    over = f"rms, geometric mean over {_count(run, best)}"
    point = f"It removes {number(share, 2)} % of the thermal error ({over})."
    return [point], [(f"{number(share, 2)} %", f"of the error removed by {best}, {_seen(run)}")]


def _left(run: Run, best: str) -> tuple[list[str], list[tuple[str, str]]]:
    """The rms of a prediction of temperatures: without a model there is nothing to compare with."""
    scored = rms_by_unit(run, best)
    if not scored:
        return [], []
    middle = [f"{number(float(np.median(rms)), 2)} {unit}".strip() for unit, rms in scored.items()]
    worst = listed([f"{number(max(rms), 2)} {unit}".strip() for unit, rms in scored.items()])
    over = f"median rms over {_count(run, best)}; largest: {worst}"
    return [f"Its rms is {listed(middle)} ({over})."], [(", ".join(middle), f"rms of {best}, {_seen(run)}")]


def _seen(run: Run) -> str:
    return "held-out recordings" if run.held_out else "recordings of the fit"


def _called(held_out: Sequence[str]) -> str:
    if len(held_out) > 4:
        return f"{len(held_out)} held-out recordings"
    return f"the held-out recording{'s' * (len(held_out) > 1)} {listed([f'“{name}”' for name in held_out])}"


def _name(run: Run, model: str) -> str:
    return f"“{model}”{' (given)' if origin(run, model) == 'given' else ''}"


def _count(run: Run, model: str) -> str:
    pairs = cells(run, model)
    recordings, outputs = {r for r, _ in pairs}, {o for _, o in pairs}
    what = "error" if is_error(run) else "output"
    return f"{counted(len(outputs), what)} and {counted(len(recordings), 'recording')}"


def _worst(run: Run, model: str) -> str:
    scored = {
        key: score["improvement"]["rms"]
        for key, score in cells(run, model).items()
        if score.get("improvement", {}).get("rms") is not None
    }
    if len(scored) < 2:
        return ""
    (low_r, low_o), low = min(scored.items(), key=lambda item: item[1])
    (high_r, high_o), high = max(scored.items(), key=lambda item: item[1])
    return (
        f"The largest reduction is {number(high, 2)} % ({high_o} on {high_r}), "
        f"the smallest {number(low, 2)} % ({low_o} on {low_r})."
    )


def _missing(run: Run) -> Part:
    """What the diagnosis says."""
    diagnosis = run.diagnosis
    if not diagnosis:
        return Part()
    verdict = str(diagnosis.get("verdict", ""))
    found = diagnosis.get("physics") or []
    lead = _VERDICTS.get(verdict, f"{verdict.capitalize()}:")
    sentence = f"{lead} “{subject(run)}”"
    if found:
        sentence += f": {_grouped(found)}"
    worse = (diagnosis.get("improvement") or {}).get("contradicted_by") or []
    if worse and found:
        contradict = "contradicts" if len(worse) == 1 else "contradict"
        sentence += f"; but the held-out {listed([f'“{name}”' for name in worse])} {contradict} the repair"
    points = [f"Size of {_placed(one)}: {listed(sizes(one))}." for one in found if sizes(one)]
    p_value = diagnosis.get("detection", {}).get("p_value")
    if p_value is not None and verdict != "no mismatch":
        chance = "less than 1 in 1000" if p_value < 1e-3 else percent(p_value)
        points.append(f"Probability that nothing is missing: {chance}.")
    rivals = [one for one in diagnosis.get("alternatives") or [] if one["log_evidence_below_best"] <= NEAR]
    if rivals:
        points.append(
            f"These recordings do not exclude {listed([_effect(one) for one in rivals], 'or')} instead."
        )
    points += _better(run) if verdict == "no mismatch" else []
    figures: list[tuple[str, str]] = []
    if found:
        proof, figures = _proof(diagnosis)
        points += [*proof, *_worse(run)]
    return Part(f"{sentence}.", tuple(points), tuple(figures))


def _better(run: Run) -> list[str]:
    """That another model predicts clearly better than one in which nothing was detected."""
    best, given = next(iter(ranked(run)), None), diagnosed_key(run)
    lead = lead_over(run, best, given) if best and given and best != given else None
    if best is None or lead is None or lead.high > _CLEARLY:
        return []
    return [
        f"“{best}” predicts better than “{given}”: its rms is {_against(lead)}. The diagnosis found no "
        "effect that explains the difference; it may be noise."
    ]


def _effect(one: Mapping[str, Any]) -> str:
    sure, together = one.get("probability"), one.get("together")
    said = f"{percent(sure)} sure" + (f", {percent(together)} that it or a rival acts" if together else "")
    return _placed(one) + (f" ({said})" if sure is not None else "")


def _grouped(found: Sequence[Mapping[str, Any]]) -> str:
    """Return the effects with their places and probabilities. One effect at several places appears once."""
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for one in found:
        alike = (words(str(one.get("effect"))), percent(one.get("probability")))
        by_itself = not one.get("states") or one.get("moved") or one.get("channels")
        groups.setdefault((*alike[:1], str(id(one))) if by_itself else alike, []).append(one)
    texts = []
    for group in groups.values():
        if len(group) == 1:
            texts.append(_effect(group[0]))
            continue
        places = listed([listed([str(s) for s in one["states"]]) for one in group])
        texts.append(
            f"{words(str(group[0]['effect']))} at {places} ({percent(group[0].get('probability'))} sure each)"
        )
    return listed(texts)


def _placed(one: Mapping[str, Any]) -> str:
    states = listed([str(state) for state in one.get("moved") or one.get("states", [])])
    where = f" at {states}" if states else f" {when(one)}" if one.get("recording") else ""
    follows = f" from {listed(one['channels'])}" if one.get("channels") else ""
    return f"{words(str(one.get('effect', 'unknown')))}{where}{follows}"


def _proof(diagnosis: Mapping[str, Any]) -> tuple[list[str], list[tuple[str, str]]]:
    """Free runs before and after the repair, on held-out recordings."""
    improvement = diagnosis.get("improvement") or {}
    points = []
    held = {
        name: s
        for name, s in (improvement.get("held_out") or {}).items()
        if s.get("rms_before") is not None and s.get("rms_after") is not None
    }
    unit = pretty_unit(improvement.get("unit") or "")
    figures = [
        (
            f"{number(s['rms_before'])} → {number(s['rms_after'])}",
            f"rms before and after the repair, {name} [{unit}]",
        )
        for name, s in list(held.items())[:3]
    ]
    if held:
        each = [
            f"{number(s['rms_before'])} → {number(s['rms_after'])} {unit}".rstrip() + f" on {name}{_gain(s)}"
            for name, s in held.items()
        ]
        points.append(f"Free runs before → after the repair, on held-out recordings (rms): {listed(each)}.")
    points += _from_known_starts(held, unit)
    if improvement.get("contradicted_by"):
        points.append(
            "On some of these recordings the repaired model is worse than the original one. Before you use "
            "it, check whether the machine was the same there, and how it began. The named effect may fit "
            "only the recordings of the diagnosis: fit more recordings in which each input moves on its own."
        )
    return points, figures


def _from_known_starts(held: Mapping[str, Mapping[str, Any]], unit: str) -> list[str]:
    """The held-out recordings whose rms from known starts is larger after the repair."""
    worse = []
    for name, one in held.items():
        before, after = one.get("from_known_starts") or (None, None)
        said = f"{number(before)} → {number(after)}"
        if before is not None and after is not None and after > before and number(before) != number(after):
            worse.append(f"{said} {unit}".rstrip() + f" on {name}")
    if not worse:
        return []
    return [
        "With start values from all readings, not from the first one, the rms is larger after the repair: "
        f"{listed(worse)}."
    ]


def _gain(one: Mapping[str, Any]) -> str:
    """The interval of an improvement, behind its figures."""
    if one.get("gain_low") is None:
        return ""
    chance = "; may be chance" if one["gain_low"] <= 0 <= one["gain_high"] else ""
    return f" (improvement, 95 %: {number(one['gain_low'])} to {number(one['gain_high'])}{chance})"


def _worse(run: Run) -> list[str]:
    """The outputs of held-out recordings that the repaired model predicts clearly worse than before."""
    given = diagnosed_key(run)
    after = next((model for model in run.results.get("models", {}) if origin(run, model) == "repaired"), None)
    if given is None or after is None or not run.held_out:
        return []
    before = cells(run, given)
    found = [
        f"{output} on {recording} ({number(old)} → {number(new)} {rms_unit(run, output)}".rstrip() + ")"
        for (recording, output), score in cells(run, after).items()
        if (old := before.get((recording, output), {}).get("rms"))
        and (new := score.get("rms"))
        and old < _CLEARLY * new
    ]
    return [f"After the repair, the rms is larger for {listed(found)}."] if found else []
