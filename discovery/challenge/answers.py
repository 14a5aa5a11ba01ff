"""Answers of any method to cases with keys: read, judged, counted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from discovery.challenge.document import said, truth_of
from discovery.challenge.lines import LINES, with_interval
from discovery.challenge.prepare import read_keys
from discovery.challenge.scoring import Answer
from discovery.challenge.tally import Scored, score_all, tally
from discovery.errors import UserError
from discovery.files import read_text
from discovery.schema import sentences


class _Open(BaseModel):
    model_config = ConfigDict(extra="allow", strict=True, allow_inf_nan=False)


class _Named(_Open):
    effect: str
    states: list[str]
    probability: float | None = None


class _Alternative(_Open):
    effect: str
    log_evidence_below_best: float


class _Answer(_Open):
    """What the score reads of a diagnosis.json; more may stand in it."""

    verdict: Literal["no mismatch", "missing physics", "measurement fault", "unexplained"]
    physics: list[_Named] = []
    alternatives: list[_Alternative] = []


def score_answers(cases: Path, answers: Path) -> list[str]:
    """Judge the answers of a method to practice cases, as the challenge judges the diagnosis.

    Args:
        cases: folder with keys.json or answers.json, as `discovery challenge --write` makes it.
        answers: folder with `case_01.json` or `case_01/diagnosis.json` for each case.

    Returns:
        A line for each case, then each figure with its count and 95 % interval.

    Raises:
        UserError: no keys, no answer at all, or an answer that is not in the form of diagnosis.json.
    """
    keys = read_keys(cases)
    found = {case: _read(answers, case) for case in keys}
    if not any(found.values()):
        first = next(iter(keys), "case_01")
        raise UserError(
            f"{answers}: no answer to any of the {len(keys)} cases of {cases}; "
            f"expected {first}.json or {first}/diagnosis.json"
        )
    scored = score_all(keys, found)
    t = tally(scored)
    width = max(len(line.title) for line in LINES)
    figures = [
        f"{line.title:{width}}  {with_interval(line, t)}" for line in LINES if line.value(t) is not None
    ]
    return [*map(_line, scored), "", *figures]


def _line(s: Scored) -> str:
    answer = said(s) if s.answer else "no answer"
    return f"{s.case}  {s.judgement.points:+.2f}  {s.judgement.word}; truth {truth_of(s.key)}, said {answer}"


def _read(folder: Path, case: str) -> Answer | None:
    paths = (folder / f"{case}.json", folder / case / "diagnosis.json")
    path = next((p for p in paths if p.is_file()), None)
    if path is None:
        return None
    try:
        content: dict[str, Any] = json.loads(read_text(path))
        _Answer.model_validate(content)
    except ValidationError as error:
        key, sentence = sentences(_Answer, content, error)[0]
        place = ".".join(map(str, key)) or "the file"
        raise UserError(f"{path}: {place}: {sentence} (the form: `discovery schema diagnosis`)") from None
    except (ValueError, RecursionError):
        raise UserError(f"{path}: not JSON; write it as `discovery schema diagnosis` describes it") from None
    return content
