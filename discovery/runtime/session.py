"""A session: a model at work on a source of readings, its memory on disk, a candidate in its shadow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from discovery.errors import UserError
from discovery.export.document import Exported, render
from discovery.export.settling import beginning
from discovery.printed import counted
from discovery.runtime.advice import measure_more
from discovery.runtime.clock import Clock
from discovery.runtime.compensator import Compensator, Settings, State, Tick
from discovery.runtime.events import Event, instant
from discovery.runtime.firsttick import refuse_wrong_units
from discovery.runtime.guards import Reading
from discovery.runtime.history import History
from discovery.runtime.output import Output
from discovery.runtime.persistence import Lock, peek, restore, save, succeed
from discovery.runtime.shadow import Rule, Shadow, begin_shadow, take_over
from discovery.runtime.store import offer, open_store, refuse_candidate, replace_active

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    from discovery.runtime.learning import Answer, Learner, Question

Say = Callable[[str], None]
CAUSES = {
    "action limit": "the residual errors exceed the action limit",
    "after a gap": "what the machine did meanwhile is not known, so the prediction is uncertain",
}


class Session:
    """Runs a compensator and everything around it.

    Args:
        model, folder, trusted: file of the model, folder of its memory, key that must have signed it.
        background: a thread that writes the state, so that a slow disk delays no tick.
        thinking: another process that compares hypotheses, so that they delay no tick; None: they do.
        clock: the steady clock of a live source; None: the stamps of the readings are the only clock.
        now: instant [s] of the first tick, where it is known; a saved state from after it is refused.

    Raises:
        UserError: another process works with this folder, or a model that may not be run.
    """

    def __init__(
        self,
        exported: Exported,
        *,
        model: Path | None = None,
        folder: Path | None = None,
        trusted: Ed25519PublicKey | None = None,
        settings: Settings | None = None,
        rule: Rule | None = None,
        save_every_s: float = 600.0,
        background: Executor | None = None,
        thinking: Executor | None = None,
        clock: Clock | None = None,
        learn: Learner | None = None,
        now: float | None = None,
        say: Say = lambda _: None,
    ) -> None:
        self.folder, self.say, self.save_every_s, self.background = folder, say, save_every_s, background
        self.learn, self.rule, self.thinking = learn, rule or Rule(), thinking
        self.asking: Future[Answer] | None = None  # what was seen, of the other process
        self.clock, self.settings = clock, settings or Settings()
        self.shadow: Shadow | None = None
        self.resumed: float | None = None
        self.resume_at: int | None = None  # bytes of the output at the time of the restored state
        self.saved: float | None = None
        self.saving: Future[None] | None = None  # the last save, which may still be under way
        self.failing: set[str] = set()  # what cannot be written, and was reported
        self.opens: Callable[[], Output] | None = None  # the output, with the first tick
        self.output: Output | None = None
        self.found: Tick | None = None  # the last tick
        self.read: set[str] = set()  # inputs whose first value came before the first offset
        self.events = 0
        self.counts: dict[str, int] = {}  # ticks by state
        self.events_now: list[Event] = []  # of the present tick
        self.history: History | None = None
        self.lock = Lock(folder) if folder is not None else None
        if folder is not None and model is not None:
            models = open_store(folder, model, exported, trusted)
            exported = models.active
            if models.candidate is not None:
                self.shadow = begin_shadow(models.candidate, self.settings, rule)
                say(
                    f"revision {models.candidate.revision} runs in the shadow of revision {exported.revision}"
                )
        self.compensator = Compensator(exported, self.settings)
        if self.learn is not None:
            self.learn.begin(self.compensator)
            if folder is not None:
                self.learn.load(self.compensator, folder)
        if folder is not None:
            facts = {
                "model": exported.model.name,
                "sha256": exported.seal.sha256,
                "revision": exported.revision,
            }
            facts["units"] = {o.name: o.unit for o in exported.outputs} | {
                i.name: i.unit for i in exported.inputs
            }
            self.history = History(folder, facts)
            self._restore(folder, now)

    def _restore(self, folder: Path, now: float | None) -> None:
        before = peek(self.compensator, folder)
        if self.clock is not None:
            if before is not None:
                self.clock.resume(dict(before.clock))
            now = self.clock.now()
        found = restore(self.compensator, folder, now if now is not None else float("inf"))
        if found is not None:
            self.resumed, self.resume_at = found.time, found.output
            gap = f", {now - found.time:.0f} s ago" if now is not None else ""
            self.tell(found.time, "restart", f"continues from the state of {instant(found.time)}{gap}")
        elif before is not None and now is not None:
            self.tell(
                now,
                "saved state refused",
                f"its time, {instant(before.time)}, is in the future; the model starts without it",
                "set the clock of this computer",
            )
        if found is None:
            succeed(self.compensator, folder)

    def say_beginning(self) -> None:
        """Without a saved state: how long the start takes, before the first tick."""
        if self.resumed is None and self.compensator.inherited is None:
            for text in beginning(self.compensator.exported):
                self.say(text)

    def tell(self, time: float, what: str, cause: str, remedy: str = "") -> None:
        """An event of the session: one line, and kept in the history."""
        self._tell(Event(time, what, cause, remedy))

    def _tell(self, event: Event) -> None:
        self.events_now.append(event)
        self.events += 1
        self.say(str(event))
        if self.history is not None:
            self.history.event(event)

    def tick(
        self,
        readings: Mapping[str, Reading],
        now: float,
        *,
        enabled: bool = True,
        part_done: bool = False,
        acknowledge: bool = False,
    ) -> Tick:
        """One tick with the newest readings, measured errors among them if there are any.

        Raises:
            UserError: the first value of an input is in a wrong unit.
        """
        self.events_now = []
        compensator = self.compensator
        if compensator.origin is None:
            refuse_wrong_units(compensator.exported.inputs, readings, self.read)
        found = compensator.tick(readings, now, enabled=enabled, part_done=part_done, acknowledge=acknowledge)
        for event in found.events:
            self._tell(event)
        self.counts[found.state.name] = self.counts.get(found.state.name, 0) + 1
        if self.shadow is not None:
            self.shadow.tick(self.compensator, readings, now)
            verdict = self.shadow.verdict(now)
            if verdict is not None:
                self._decide(*verdict, now)
        self.found = found
        if self.output is None and self.opens is not None:
            self.output = self.opens()
        self._write(found, readings, now)
        if self.learn is not None:
            self._learn(self.learn, readings, now)
        if self.folder is not None and (self.saved is None or not 0 <= now - self.saved < self.save_every_s):
            self.save(now)
        return found

    def _write(self, found: Tick, readings: Mapping[str, Reading], now: float) -> None:
        if self.output is not None:
            error = self.output.write(line(self.compensator, found))
            self._heard("output", f"{self.output.path}: the offsets cannot be written", error, now)
        if self.history is not None:
            self.history.tick(self.compensator, found, readings, now)
            error_of_history = self.history.flush(now)
            self._heard(
                "history", f"{self.history.path}: the history cannot be written", error_of_history, now
            )

    def _heard(self, what: str, text: str, error: Exception | None, now: float) -> None:
        """Tell the first of several failures to write, and when it is over."""
        if error is not None and what not in self.failing:
            self.failing.add(what)
            remedy = "free disk space; lines that are not written yet are kept in memory"
            self.tell(now, f"{what} failing", f"{text} ({error}); the compensation continues", remedy)
        elif error is None and what in self.failing and not self._pending(what):
            self.failing.discard(what)
            self.tell(now, f"{what} written again", "writing works again, nothing is missing")

    def _pending(self, what: str) -> bool:
        return what == "output" and self.output is not None and bool(self.output.pending)

    def _decide(self, passed: bool, why: str, now: float) -> None:
        assert self.shadow is not None
        assert self.folder is not None
        old, new = self.compensator.exported, self.shadow.compensator.exported
        if passed:
            self.compensator = take_over(self.compensator, self.shadow.compensator)
            replace_active(self.folder)
            self.saved = None
        else:
            refuse_candidate(self.folder)
        if self.learn is not None and passed:
            self.learn.follow(self.compensator, self.shadow.began)
        what = "the new model takes over" if passed else "the new model is refused"
        self.tell(now, what, f"revision {new.revision} after revision {old.revision}: {why}")
        self.shadow = None

    def summary(self) -> str:
        """How the run went, in a line."""
        total = sum(self.counts.values())
        shares = ", ".join(f"{name} {100 * n / total:.1f} %" for name, n in self.counts.items())
        last = self.found.state.name if self.found is not None else "OFF"
        return f"{counted(total, 'tick')}: {shares}; {counted(self.events, 'event')}; ended {last}"

    def judge(self) -> None:
        """What the exit status has to say.

        Raises:
            UserError: no offset was ever given out, the run ended in trouble, or lines were not written.
        """
        if self.compensator.origin is None:
            absent = [g.spec.name for g in self.compensator.guards if g.held is None]
            raise UserError(
                f"there was no offset: {', '.join(absent) or 'the inputs'} never had a good reading; "
                "each input of the model needs one"
            )
        if self.output is not None and (self.output.pending or self.output.lost):
            raise UserError(f"{self.output.path}: the last offsets are not written; free disk space")
        if self.found is not None and self.found.state in (State.FAULT, State.FROZEN):
            raise UserError(f"the compensation ended in {self.found.state.name}; its last event says why")

    def _learn(self, learn: Learner, readings: Mapping[str, Reading], now: float) -> None:
        """Measured errors as they come: when to measure, when to update, and the update."""
        advised = learn.advice
        due = learn.observe(self.compensator, readings, now)
        if self.folder is not None:
            learn.save(self.compensator, self.folder, now)
        if learn.advice and not advised:
            self.tell(now, learn.because, CAUSES[learn.because], learn.advice)
        elif advised and not learn.advice and learn.because == "action limit":
            self.tell(now, "action limit kept", "the residual errors are within the action limit again")
        if due and self.asking is None and self.shadow is None and self.folder is not None:
            self.asking = self._ask(learn.question(self.compensator, now))
        if self.asking is not None and self.asking.done():
            asking, self.asking = self.asking, None
            self._answered(learn, asking, now)

    def _ask(self, question: Question) -> Future[Answer]:
        from discovery.runtime.learning import answer

        if self.thinking is not None:
            return self.thinking.submit(answer, question)
        asked: Future[Answer] = Future()
        try:
            asked.set_result(answer(question))
        except UserError as error:
            asked.set_exception(error)
        return asked

    def _answered(self, learn: Learner, asked: Future[Answer], now: float) -> None:
        error = asked.exception()
        if error is not None:
            self.learn = None
            self.tell(now, "learning ends", str(error) or type(error).__name__)
            return
        found, revised = asked.result()
        quiet = found.verdict in ("nothing", "wear goes on") or (found.verdict, found.what) == learn.said
        learn.said = found.verdict, found.what
        if quiet and revised is None:
            return
        remedy = {
            "input sensor": f"check the sensor of {found.what}",
            "new physics": "record the machine and run `discovery update`, which can say more",
            "something else": "record the machine and run `discovery update`, which can name the change",
            "undecided": measure_more([one.name for one in self.compensator.exported.inputs]),
        }.get(found.verdict, "")
        self.tell(now, f"learning: {found.verdict}", str(found), remedy)
        if revised is not None:
            self._offer(render(revised, learn.key), now)

    def _offer(self, data: bytes, now: float) -> None:
        """Let a new revision run in the shadow. Measured errors must confirm it."""
        assert self.folder is not None
        candidate = offer(self.folder, data)
        rule = Rule(hours=self.rule.hours, most_um=None)
        self.shadow = begin_shadow(candidate, self.settings, rule)
        self.tell(now, "shadow run", f"revision {candidate.revision} runs in the shadow of the active model")

    def save(self, now: float) -> None:
        """Write the state to disk, unless the save before is still under way; what the output holds first."""
        if self.folder is None or self.compensator.origin is None:
            return
        if self.saving is not None and not self.saving.done():
            return
        self._hear(now)
        output = self.output
        if output is not None and output.flush() is not None:
            return  # a state may not claim lines that no disk has
        if self.history is not None:
            self.history.flush(now, force=True)
        more = {
            "output": output.size if output is not None and output.file is not None else None,
            "clock": self.clock.saved() if self.clock is not None else {},
        }
        first = output.sync if output is not None else lambda: None
        self.saving = save(self.compensator, self.folder, self.background, more=more, first=first)
        self.saved = now
        if self.background is None:
            self._hear(now)

    def close(self, now: float) -> None:
        """Write the state and what was learnt a last time, and wait until they stand on the disk."""
        self._hear(now)
        self.save(now)
        if self.learn is not None and self.folder is not None and self.learn.seen.times:
            self.learn.save(self.compensator, self.folder, now, last=True)
        self._hear(now)
        if self.output is not None:
            self.output.close()
        if self.history is not None:
            self.history.close(now)
        if self.lock is not None:
            self.lock.close()

    def _hear(self, now: float) -> None:
        """Read the result of the last save. Of several failures, only the first is reported."""
        if self.saving is None:
            return
        with suppress(BaseException):
            self.saving.result()
        error, self.saving = self.saving.exception(), None
        if error is not None and "state" not in self.failing:
            self.tell(
                now,
                "state failing",
                f"{self.folder}: the state cannot be saved ({error}); the compensation continues, but "
                f"a restart "
                "would start from an older state",
                "free disk space, or name another folder with --state",
            )
        if error is not None:
            self.failing.add("state")
        elif "state" in self.failing:
            self.failing.discard("state")
            self.tell(now, "state saved again", "writing works again")


def header(compensator: Compensator) -> str:
    """First line of the output: time [s] at which the offsets are valid, state, status word, heartbeat,
    offsets, model.
    """
    return ",".join(["time", "state", "status", "heartbeat", *compensator.names, "model"]) + "\n"


def line(compensator: Compensator, tick: Tick) -> str:
    """A tick as a line of CSV."""
    numbers = [f"{tick.offsets[name]:.4f}" for name in compensator.names]
    cells = [f"{tick.valid_at:.10g}", tick.state.name, str(tick.status), str(tick.heartbeat), *numbers]
    return ",".join([*cells, compensator.exported.seal.sha256[:12]]) + "\n"
