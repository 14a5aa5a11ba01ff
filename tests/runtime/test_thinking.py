"""Hypotheses are compared by another process: no tick waits for them, and none is lost with it."""

from __future__ import annotations

import time
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from discovery.export.document import Exported
from discovery.export.seal import private_key
from discovery.runtime.compensator import Settings, State
from discovery.runtime.guards import Reading
from discovery.runtime.learning import LEAST, Learner, Question, answer
from discovery.runtime.session import Session
from discovery.runtime.thinking import other_process

TICK, HOUR = 60.0, 3600.0


class Slow(Executor):
    """Another process that never comes to an end by itself."""

    def __init__(self) -> None:
        self.asked: list[Question] = []
        self.given: list[Future[Any]] = []

    def submit(self, _: Any, /, *args: Any, **__: Any) -> Future[Any]:
        self.asked.append(args[0])
        self.given.append(Future())
        return self.given[-1]


def hours(
    session: Session, minutes: np.ndarray, first: int, count: int, *, lost: tuple[int, int] = (0, 0)
) -> None:
    """Ticks every minute with errors every half hour; the fluid sensor is lost in some hours."""
    names = session.compensator.exported.compiled.inputs
    for k in range(60 * first, 60 * (first + count)):
        now = TICK * k
        readings = {n: Reading(v, now) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        if lost[0] * HOUR <= now < lost[1] * HOUR:
            del readings["T_fluid"]
        if k % 30 == 0 and session.compensator.predicted is not None:
            readings |= {n: Reading(0.0, now) for n in session.compensator.names}
        session.tick(readings, now)


@pytest.fixture
def work(exported: Exported, model_file: Path, tmp_path: Path) -> tuple[Session, Slow, list[str]]:
    said, thinking = list[str](), Slow()
    session = Session(
        exported, model=model_file, folder=tmp_path / "memory", settings=Settings(tick_s=TICK),
        learn=Learner(private_key(tmp_path / "key.pem")), thinking=thinking, say=said.append,
    )  # fmt: skip
    return session, thinking, said


def test_ticks_go_on_while_another_process_thinks(
    work: tuple[Session, Slow, list[str]], minutes: np.ndarray
) -> None:
    session, thinking, said = work
    hours(session, minutes, 0, 24)
    [question] = thinking.asked  # one at a time, however long it takes
    assert len(question.campaign.recordings["running"].time) > LEAST
    assert session.found is not None
    assert session.found.state is State.ACTIVE
    found, _ = answer(question)
    thinking.given[0].set_result((found, None))
    hours(session, minutes, 24, 1)
    assert next(text for text in said if "learning" in text).split(": ")[1] == found.verdict
    assert session.learn is not None
    hours(session, minutes, 25, 5)
    assert len(thinking.asked) == 2  # and the next question comes in time


def test_a_process_that_dies_ends_the_learning_and_nothing_else(
    work: tuple[Session, Slow, list[str]], minutes: np.ndarray
) -> None:
    session, thinking, said = work
    hours(session, minutes, 0, 14)
    thinking.given[0].set_exception(RuntimeError("killed"))
    hours(session, minutes, 14, 2)
    assert "learning ends: killed" in said[-1]
    assert session.learn is None
    assert session.found is not None
    assert session.found.state is State.ACTIVE


def test_what_an_input_was_held_for_is_not_learnt_from(
    work: tuple[Session, Slow, list[str]], minutes: np.ndarray
) -> None:
    session, _, _ = work
    hours(session, minutes, 0, 20, lost=(14, 16))
    assert session.learn is not None
    seen = session.learn.seen
    assert seen.times[0] >= 16 * HOUR  # after two hours without an input the recording begins anew
    assert len(seen.times) == len(seen.errors)


def test_after_a_take_over_only_what_the_new_model_has_not_seen_is_kept(
    work: tuple[Session, Slow, list[str]], minutes: np.ndarray
) -> None:
    session, _, _ = work
    hours(session, minutes, 0, 20)
    learn = session.learn
    assert learn is not None
    times = list(learn.seen.times)
    marks = [(times[row], states) for row, states in learn.seen.marks]
    since = marks[1][0] + 30.0
    learn.follow(session.compensator, since)
    assert learn.seen.times == [t for t in times if t >= marks[1][0]]
    assert learn.seen.marks[0] == (0, marks[1][1])
    assert learn.new == sum(1 for row in learn.seen.errors if row)
    learn.follow(session.compensator, None)
    assert learn.seen.times == []


def test_a_planned_stop_loses_nothing_of_what_was_learnt(
    work: tuple[Session, Slow, list[str]], minutes: np.ndarray
) -> None:
    session, _, _ = work
    hours(session, minutes, 0, 12)
    assert session.learn is not None
    assert len(session.learn.seen.times) > 60
    session.close(12 * HOUR)
    assert session.folder is not None
    again = Learner(session.learn.key)
    again.load(session.compensator, session.folder)
    assert again.seen.times == session.learn.seen.times
    assert again.seen.inputs == session.learn.seen.inputs


def test_another_process_gives_the_same_answer(
    work: tuple[Session, Slow, list[str]], minutes: np.ndarray
) -> None:
    session, thinking, _ = work
    hours(session, minutes, 0, 14)
    with other_process() as other:
        asked = other.submit(answer, thinking.asked[0])
        began, ticks = time.perf_counter(), 0
        while not asked.done():  # ticks of this process meanwhile
            session.compensator.tick({}, 15 * HOUR)
            ticks += 1
            assert time.perf_counter() - began < 120.0
    assert asked.result()[0].odds == pytest.approx(answer(thinking.asked[0])[0].odds)
    assert ticks > 10  # a tick that waits for the comparison is the only one until its end
