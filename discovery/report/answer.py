"""The first screen: the answer in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from discovery.report.mismatch import NEAR, sizes
from discovery.report.ranking import (
    astray,
    cells,
    is_error,
    mean_improvement,
    origin,
    ranked,
    ratio,
    rms_by_unit,
)
from discovery.report.recommended import recommended
from discovery.report.run import Run, pretty_unit
from discovery.report.text import counted, listed, number, percent, words

_VERDICTS = {
    "no mismatch": "Nothing is missing that these recordings could show",
    "missing physics": "Physics is missing",
    "measurement fault": "The measurement is at fault, not the physics",
    "unexplained": "Something is missing that the catalogue does not explain",
}


@dataclass(frozen=True)
class Answer:
    """`headline`: one sentence. `points`: what supports it. `figures`: (figure, caption), to show large."""

    headline: str
    points: tuple[str, ...]
    figures: tuple[tuple[str, str], ...]
    physics: str = ""  # the verdict of the diagnosis in one sentence
    physics_points: tuple[str, ...] = ()


def answer(run: Run) -> Answer:
    """What the run says, in words and in few figures."""
    headline, points, figures = _models(run)
    physics, physics_points = _physics(run.diagnosis)
    if not headline:
        headline, physics = physics, ""
    return Answer(headline, tuple(points), tuple(figures), physics, tuple(physics_points))


def _models(run: Run) -> tuple[str, list[str], list[tuple[str, str]]]:
    order = [model for model in ranked(run) if cells(run, model)]
    if not order:
        return "", [], []
    best = order[0]
    unseen = [r for r in run.held_out if r not in astray(run, best)]
    where = f"on {_called(unseen)}" if unseen else "on the recordings it was fitted to"
    named = f" “{best}”" if best != origin(run, best) else ""
    rivals = [
        model
        for model in order[1:]
        if math.isfinite(ratio(run, best, model)) and astray(run, model) == astray(run, best)
    ]
    overall = f"The {origin(run, best)} model{named} predicts best {where}{_nearly(run, best, rivals)}."
    headline = recommended(run, where) or overall
    points, figures = _removed(run, best) if is_error(run) else _left(run, best)
    if headline != overall:
        points = [overall, *points]
    compared = [f"{_less(ratio(run, best, model))} {_name(run, model)}" for model in rivals]
    if compared:
        points.append(f"It leaves {listed(compared)}.")
    figures += [
        (_less(ratio(run, best, model), short=True), f"rms left by {best} against {model}")
        for model in [
            m for m in rivals if origin(run, m) == "hand-built" and abs(ratio(run, best, m) - 1) > 0.02
        ][:2]
    ]
    if is_error(run) and (worst := _worst(run, best)):
        points.append(worst)
    points += [f"“{model}” runs away on {_called(lost)}." for model in order if (lost := astray(run, model))]
    if not run.held_out:
        points.append(
            "No recording was held out: these figures say how well the models fit, not how well they predict."
        )
    return headline, points, figures


def _removed(run: Run, best: str) -> tuple[list[str], list[tuple[str, str]]]:
    """How much of the thermal error is gone; the error without compensation is what was read."""
    improved = mean_improvement(run, best)
    if not math.isfinite(improved):
        return [], []
    point = f"It removes {number(improved, 2)} % of the thermal error (rms, mean over {_count(run, best)})."
    return [point], [(f"{number(improved, 2)} %", f"of the error removed by {best}, {_seen(run)}")]


def _left(run: Run, best: str) -> tuple[list[str], list[tuple[str, str]]]:
    """How far off a prediction of temperatures is: without a model there is nothing to compare with."""
    scored = rms_by_unit(run, best)
    if not scored:
        return [], []
    middle = [f"{number(float(np.median(rms)), 2)} {unit}".strip() for unit, rms in scored.items()]
    worst = listed([f"{number(max(rms), 2)} {unit}".strip() for unit, rms in scored.items()])
    over = f"median rms over {_count(run, best)}, at worst {worst}"
    return [f"It is off by {listed(middle)} ({over})."], [
        (", ".join(middle), f"left by {best}, {_seen(run)}")
    ]


def _seen(run: Run) -> str:
    return "unseen recordings" if run.held_out else "fitted recordings"


def _called(unseen: Sequence[str]) -> str:
    if len(unseen) > 4:
        return f"{len(unseen)} unseen recordings"
    return f"the unseen recording{'s' * (len(unseen) > 1)} {listed([f'“{name}”' for name in unseen])}"


def _nearly(run: Run, best: str, rivals: Sequence[str]) -> str:
    """A winner by less than 5 % has no lead worth the name."""
    close = [model for model in rivals if ratio(run, best, model) > 0.95]
    return f", and {listed([f'“{model}”' for model in close])} nearly as well" if close else ""


def _name(run: Run, model: str) -> str:
    return f"“{model}”{' (hand-built)' if origin(run, model) == 'hand-built' else ''}"


def _less(share: float, short: bool = False) -> str:
    if 0.995 < share < 1.005:
        return "0 %" if short else "as much as"
    change = f"{100 * abs(share - 1):.0f} %"
    if short:
        return f"{'−' if share < 1 else '+'}{change}"
    return f"{change} {'less than' if share < 1 else 'more than'}"


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
    least, most = f"{number(low, 2)} % ({low_o} on {low_r})", f"{number(high, 2)} % ({high_o} on {high_r})"
    return f"Between {least} and {most} of each error is removed."


def _physics(diagnosis: Mapping[str, Any] | None) -> tuple[str, list[str]]:
    if not diagnosis:
        return "", []
    verdict = str(diagnosis.get("verdict", ""))
    found = diagnosis.get("physics") or []
    model = diagnosis.get("model", "the model")
    lead = _VERDICTS.get(verdict, verdict.capitalize())
    sentence = f"{lead} in “{model}”"
    if found:
        sentence += f": {listed([_effect(one) for one in found])}"
    worse = (diagnosis.get("improvement") or {}).get("contradicted_by") or []
    if worse:
        contradict = "contradicts" if len(worse) == 1 else "contradict"
        sentence += f"; but the unseen {listed([f'“{name}”' for name in worse])} {contradict} the repair"
    points = [f"Size of {words(one['effect'])}: {listed(sizes(one))}." for one in found if sizes(one)]
    p_value = diagnosis.get("detection", {}).get("p_value")
    if p_value is not None and verdict != "no mismatch":
        chance = "less than 1 in 1000" if p_value < 1e-3 else percent(p_value)
        points.append(f"Probability that the model lacks nothing: {chance}.")
    points += _proof(diagnosis) if found else []
    rivals = [one for one in diagnosis.get("alternatives") or [] if one["log_evidence_below_best"] <= NEAR]
    if rivals:
        points.append(
            f"These recordings cannot tell it from {listed([_effect(one) for one in rivals], 'or')}."
        )
    return sentence + ".", points


def _effect(one: Mapping[str, Any]) -> str:
    states = listed([str(state) for state in one.get("moved") or one.get("states", [])])
    where = f" at {states}" if states else f" in {one['recording']}" if one.get("recording") else ""
    sure = one.get("probability")
    text = f"{words(str(one.get('effect', 'unknown')))}{where}"
    return text + (f" ({percent(sure)} sure)" if sure is not None else "")


def _proof(diagnosis: Mapping[str, Any]) -> list[str]:
    improvement = diagnosis.get("improvement") or {}
    points = []
    held = {
        name: s
        for name, s in (improvement.get("held_out") or {}).items()
        if s.get("rms_before") is not None and s.get("rms_after") is not None
    }
    if held:
        unit = pretty_unit(improvement.get("unit") or "")
        each = [
            f"{number(s['rms_before'])} → {number(s['rms_after'])} {unit}".rstrip() + f" on {name}"
            for name, s in held.items()
        ]
        points.append(
            "Repaired and run freely on unseen recordings it leaves (rms, errors weighed by "
            f"their noise): {listed(each)}."
        )
    explained = improvement.get("explained")
    if improvement.get("contradicted_by"):
        points.append(
            "There it is worse than without: what is named fits the recordings at hand and may be no more "
            "than that. Do not use the repaired model; fit more recordings, each input moving on its own."
        )
    elif explained is not None:
        share = percent(explained) if explained >= 0.005 else "nothing"
        points.append(f"The repair closes {share} of the gap that can be closed there.")
    return points
