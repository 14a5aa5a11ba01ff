"""The end of a run in five lines: which model, how sure, what is missing, what is doubtful, what to do
next.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from discovery.report.heat import diagnosed_key
from discovery.report.lead import Lead, lead_over
from discovery.report.ranking import astray, cells, ranked, ratio, rms_by_unit
from discovery.report.run import Run, load_run
from discovery.runfolder import DIAGNOSIS
from discovery.terms import names

_BETTER = 0.95  # of the rms without a model: less is no improvement
_CONSTANT, _TIMES = 0.8, 2.0  # of the rms, and times the rms in the fit: a miss that is mostly a constant
_MOVES = 0.05  # share of an effect from which a guess matters


@dataclass(frozen=True)
class Ending:
    """What a run found. `winner`: None where no model is better than none, which is `best`, then.
    `diagnosed`: the model that the verdict is about; `diagnosed_ratio`: its rms on held-out recordings
    over that without a model. `repaired_ratio`: the rms there after the repair over that before. `constants`:
    where the best model is off by a constant.
    """

    best: str | None
    winner: str | None
    against_none: Lead | None
    runner_up: str | None
    against_runner_up: Lead | None
    rms: Mapping[str, float]
    held_out: Sequence[str]
    verdict: str | None
    diagnosed: str | None
    diagnosed_ratio: float | None
    repaired_ratio: float | None
    effects: Sequence[str]
    findings: Sequence[str]
    constants: Sequence[str]
    guesses: Mapping[str, str]
    hangs_on_guesses: Mapping[str, float]
    next: str
    report: str
    seconds: float

    def document(self) -> dict[str, Any]:
        """For `--json`."""
        return asdict(self)

    def lines(self) -> list[str]:
        """Five lines for the terminal."""
        return [
            self._winner(),
            self._sure(),
            self._verdict(),
            self._doubts(),
            f"next: {self.next}; report: {self.report}",
        ]

    def _winner(self) -> str:
        where = f"{len(self.held_out)} held-out recording{'s' * (len(self.held_out) != 1)}"
        where = where if self.held_out else "the recordings of the fit (none is held out)"
        if self.best is None:
            return "winner: none, no model could be compared"
        rms = ", ".join(f"{value:.3g} {unit}".strip() for unit, value in self.rms.items())
        none = self.against_none
        if self.winner is None or none is None:
            share = f"{none.ratio:.0%}" if none else "more than 100%"
            return (
                f"winner: no model; the best one, {self.best}, has {share} of the rms without a model "
                f"on {where}: do not use it"
            )
        what = f"{self.winner} predicts best" if self.runner_up else f"{self.winner}, the only model,"
        return f"winner: {what} on {where}: rms {rms}, {1 - none.ratio:.0%} less than without a model"

    def _sure(self) -> str:
        lead, other = self.against_runner_up, self.runner_up
        if lead is None or other is None or self.best is None:
            return "how sure: there is no other model to compare with"
        difference = f"{abs(1 - lead.ratio):.0%}"
        said = f"{difference} {'smaller' if lead.ratio < 1 else 'larger'} than"
        said = "the same as" if difference == "0%" else said
        low, high = sorted((1 - lead.low, 1 - lead.high))
        close = "" if lead.high < 1 else "; the recordings do not separate the two"
        return (
            f"how sure: its rms is {said} that of {other} (95 %: {low:.0%} to {high:.0%} smaller; "
            f"better in {lead.sure:.0%} of resampled recordings){close}"
        )

    def _verdict(self) -> str:
        if self.verdict is None:
            return "verdict: no diagnosis ([mismatch] names no model)"
        effects = f": {', '.join(self.effects)}" if self.effects else ""
        ratio, but = self.diagnosed_ratio, ""
        about = f" in {self.diagnosed}" if self.diagnosed and self.diagnosed != self.winner else ""
        if self.verdict == "no mismatch" and ratio is not None and ratio > _BETTER:
            but = (
                f" in the recordings of the fit; but on the held-out ones {self.diagnosed} has "
                f"{ratio:.0%} of the rms without a model"
            )
            about = ""
        if self.repaired_ratio is not None and self.repaired_ratio > 1 / _BETTER:
            times = f"{self.repaired_ratio:.2f} times as large"
            but = f"; but the repair makes the rms on held-out recordings {times}"
        return f"verdict: {self.verdict}{about}{effects}{but}"

    def _doubts(self) -> str:
        worst_first = []
        if self.findings:
            worst = self.findings[0]
            rest = f" (and {len(self.findings) - 1} more: discovery check)" if self.findings[1:] else ""
            worst_first.append(f"{worst}{rest}")
        if self.constants:
            where = ", ".join(self.constants[:3])
            worst_first.append(
                f"{self.best} misses {where}, much the same at all times: another zero of the probe (state "
                "`spread`), or something that acts there alone"
            )
        if self.guesses:
            named = [
                f"{name} ({self.hangs_on_guesses[name]:.0%} of the prediction)"
                if name in self.hangs_on_guesses
                else name
                for name in sorted(self.guesses, key=lambda n: -self.hangs_on_guesses.get(n, 0.0))
            ]
            worst_first.append(
                f"the guesses for {', '.join(named[:4])} are not confirmed (if right, delete `guessed` "
                "in the campaign file)"
            )
        return (
            f"doubts: {'; '.join(worst_first)}" if worst_first else "doubts: none; the recordings are sound"
        )


def ending(folder: Path) -> Ending:
    """What the run in a folder found. Raises UserError where there is none."""
    run = load_run(folder)
    order = [model for model in ranked(run) if cells(run, model)]
    best = order[0] if order else None
    none = lead_over(run, best, None) if best else None
    helps = none is not None and none.ratio < _BETTER and not (best and astray(run, best))
    other = order[1] if len(order) > 1 else None
    diagnosis = run.diagnosis if (folder / DIAGNOSIS).exists() else None
    about = diagnosed_key(run) if diagnosis else None
    about = about if about and run.held_out and cells(run, about) else None
    guesses = dict(run.results.get("guessed") or {})
    rms = (
        {u: float(np.sqrt(np.mean(np.square(v)))) for u, v in rms_by_unit(run, best).items()} if best else {}
    )
    return Ending(
        best,
        best if helps else None,
        none,
        other,
        lead_over(run, best, other) if best and other else None,
        rms,
        list(run.held_out),
        str(diagnosis["verdict"]) if diagnosis else None,
        about,
        ratio(run, about, None) if about else None,
        repaired_ratio(diagnosis) if diagnosis else None,
        [_effect(one) for one in (diagnosis or {}).get("physics") or []],
        list(run.results.get("findings") or []),
        constants(run, best) if best else [],
        guesses,
        hanging(run, best, guesses) if best else {},
        _next(run, best, helps, diagnosis, guesses),
        str(folder / "report.html"),
        float(run.results.get("seconds") or 0.0),
    )


def repaired_ratio(diagnosis: Mapping[str, Any]) -> float | None:
    """The rms of free runs of all held-out recordings after the repair over that before; None without one."""
    held = [one for one in (diagnosis.get("improvement") or {}).get("held_out", {}).values() if one]
    before, after = (
        np.array([one.get(key) or np.nan for one in held]) for key in ("rms_before", "rms_after")
    )
    if not diagnosis.get("physics") or not len(held) or not np.isfinite(before + after).all():
        return None
    return float(np.sqrt(np.mean(after**2) / np.mean(before**2)))


def constants(run: Run, model: str) -> list[str]:
    """Errors that a model misses in a held-out recording by much the same at all times, and by more than in
    the fit: a zero that is not the same, rather than a law.
    """
    seen = run.results["models"][model].get("recordings") or {}
    roles = run.results.get("roles") or {}
    found = []
    for recording in run.held_out:
        for output, one in (seen.get(recording) or {}).items():
            fitted = [seen[r][output]["rms"] for r in run.results.get("fit", []) if output in seen.get(r, {})]
            usual = float(np.sqrt(np.mean(np.square(fitted)))) if fitted else np.inf
            is_error = roles.get(output, "error") == "error"
            if is_error and one["rms"] > _TIMES * usual and abs(one["mean"]) > _CONSTANT * one["rms"]:
                unit = (run.results.get("units") or {}).get(output, "")
                found.append(f"{output} by {one['mean']:.2g} {unit} in {recording}")
    return found


def _effect(one: Mapping[str, Any]) -> str:
    where = ", ".join(one.get("moved") or one.get("states") or [])
    where += f" from {', '.join(one['channels'])}" if one.get("channels") else ""
    sure = f" ({one['probability']:.0%})" if one.get("probability") is not None else ""
    return f"{one['effect']}{f' at {where}' if where else ''}{sure}"


def _next(
    run: Run, best: str | None, helps: bool, diagnosis: Mapping[str, Any] | None, guesses: Mapping[str, str]
) -> str:
    """The one thing that helps most now."""
    if guesses and (not helps or (diagnosis or {}).get("verdict") in ("unexplained", None)):
        which = ", ".join(list(guesses)[:3])
        return f"confirm or correct {which} in the campaign file, then `discovery new DIR --again`"
    if not run.held_out:
        return "hold out a recording: only that shows how well a model predicts"
    if (
        diagnosis
        and diagnosis.get("next_experiment")
        and not (helps and diagnosis["verdict"] == "no mismatch")
    ):
        return str(diagnosis["next_experiment"]).rstrip(".")
    if not helps:
        return "record the inputs that drive the machine, and let each one move on its own"
    roles = run.results.get("roles") or {}
    if all(roles.get(output, "error") != "error" for output in run.outputs):
        path = f"{run.folder}/models/{best}.toml"
        return f"the model is {path}; no output is an error, so there is nothing to compensate"
    export = f"`discovery export {shlex.quote(str(run.folder))} --model {shlex.quote(str(best))} --to json`"
    if diagnosed_key(run) == best:
        return export
    return f'{export}, or diagnose it ([mismatch] model = "{best}")'


def hanging(run: Run, model: str, guesses: Mapping[str, str]) -> dict[str, float]:
    """How much of what a model predicts each guessed channel carries: its share of the terms that hold it;
    1 for an output, which is all that is predicted.
    """
    shares = run.results["models"][model].get("shares") or {}
    terms = run.models[model].terms if model in run.models else ()
    found = {}
    for name in guesses:
        carried = sum(float(shares.get(term.name) or 0.0) for term in terms if name in names(term.expression))
        carried = 1.0 if name in run.outputs else carried
        if carried >= _MOVES:
            found[name] = min(1.0, carried)
    return found
