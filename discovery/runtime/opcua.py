"""OPC UA: readings from a machine's server, offsets back to it, signed and encrypted or not at all."""

from __future__ import annotations

import asyncio
import math
import signal
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.stepper import Stepper
from discovery.files import read_toml
from discovery.printed import counted
from discovery.runtime.clock import Clock
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.notify import notify
from discovery.runtime.opcua_connect import UnreachableError
from discovery.runtime.opcua_form import ConnectionForm
from discovery.runtime.opcua_link import Link, Seen
from discovery.runtime.output import Output
from discovery.runtime.session import Say, Session, header
from discovery.runtime.signals import Asked
from discovery.runtime.thinking import other_process

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    from discovery.runtime.learning import Learner
    from discovery.runtime.shadow import Rule

RETRY_S = 5.0


@dataclass
class Punctuality:
    """Ticks, and how many were late: begun late by a tenth, or not done when the next was due."""

    ticks: int = 0
    late: int = 0
    worst_s: float = 0.0
    work_s: float = 0.0
    states: dict[str, int] = field(default_factory=dict)

    @property
    def share(self) -> float:
        """Share of ticks in time."""
        return 1.0 - self.late / max(self.ticks, 1)

    def __str__(self) -> str:
        mean = 1e3 * self.work_s / max(self.ticks, 1)
        return (
            f"{counted(self.ticks, 'tick')}, {100 * self.share:.2f} % in time, {mean:.1f} ms of work each, "
            f"worst {1e3 * self.worst_s:.0f} ms; "
            + ", ".join(f"{name} {count}" for name, count in self.states.items())
        )


async def run_loop(
    link: Link, session: Session, seconds: float | None, asked: Asked | None = None
) -> Punctuality:
    """Tick for `seconds` (None: until stopped); a lost connection is tried again while the ticks go on.

    The last tick switches the compensation off, so that the machine sees that nobody compensates any more.
    """
    tick_s, found, clock = link.form.tick_s, Punctuality(), link.clock
    seen, again, asked = Seen(), None, asked or Asked()
    await _begin(link, session)
    began = due = time.monotonic()
    notify(READY=1)
    try:
        while (seconds is None or due - began < seconds) and not asked.stop:
            start = time.monotonic()
            if link.client is not None:
                try:
                    seen = await asyncio.wait_for(link.read(), 0.8 * tick_s)
                except Exception as error:
                    await _lost(link, session, f"the inputs cannot be read ({_word(error)})")
            if link.client is None and (again is None or again.done()):
                again = asyncio.create_task(_reconnect(link, session))
            _tell_jump(clock, session)
            # values that are no longer renewed grow too old by themselves: the guards see to it
            acknowledge = asked.acknowledged() or seen.acknowledge
            _under_offsets(link.form, session, seen)
            tick = session.tick(
                seen.readings,
                clock.now(),
                enabled=seen.enabled,
                part_done=seen.part_done,
                acknowledge=acknowledge,
            )
            seen.acknowledge = False
            if link.client is not None:
                try:
                    await asyncio.wait_for(link.write(tick), 0.8 * tick_s)
                except Exception as error:
                    await _lost(link, session, f"the offsets cannot be written ({_word(error)})")
            notify(WATCHDOG=1, STATUS=f"{tick.state.name}, {counted(tick.heartbeat, 'tick')}")
            end = time.monotonic()
            found.ticks += 1
            found.late += start - due > 0.1 * tick_s or end > due + tick_s
            found.worst_s, found.work_s = max(found.worst_s, end - due), found.work_s + end - start
            found.states[tick.state.name] = found.states.get(tick.state.name, 0) + 1
            due += tick_s
            if end > due + 10 * tick_s:  # after a sleep of the computer: no burst of ticks
                due = end
            await _until(due, asked)
    finally:
        if again is not None:
            again.cancel()
        notify(STOPPING=1)
        try:
            await _switch_off(link, session)
        finally:
            session.close(clock.now())
            await link.close()
    return found


async def _begin(link: Link, session: Session) -> None:
    """Without a saved state the offsets go on from those at the server: the machine must see no step."""
    if session.resumed is not None or link.client is None:
        return
    compensator = session.compensator
    for name, value in (await link.offsets()).items():
        k = compensator.names.index(name)
        if math.isfinite(value) and abs(value) <= compensator.limit[k]:
            compensator.offsets[k] = value


async def _switch_off(link: Link, session: Session) -> None:
    tick = session.tick({}, link.clock.now(), enabled=False)
    if link.client is not None:
        try:
            await asyncio.wait_for(link.write(tick), 4.0)
        except Exception as error:
            session.tell(link.clock.now(), "stop", f"state OFF cannot be written ({_word(error)})")


async def _until(due: float, asked: Asked) -> None:
    """Wait for the next tick, or for a stop."""
    while (left := due - time.monotonic()) > 0.0 and not asked.stop:
        await asyncio.sleep(min(left, 0.25))


def _tell_jump(clock: Clock, session: Session) -> None:
    moved = clock.jumped()
    if moved:
        session.tell(
            clock.now(),
            "clock",
            f"the wall clock was set by {moved:+.0f} s; the compensation continues with its own time",
        )


def _under_offsets(form: ConnectionForm, session: Session, seen: Seen) -> None:
    """Measured errors are what the offsets leave: each is stored with what the offsets took off."""
    if form.errors_are == "left":
        for name, offset in zip(session.compensator.names, session.compensator.offsets, strict=True):
            if name in form.errors and name in seen.readings:
                seen.readings[f"{name}_applied"] = Reading(-offset, seen.readings[name].time)


def _word(error: Exception) -> str:
    return f"{type(error).__name__} {error}".strip()[:100]


async def _lost(link: Link, session: Session, what: str) -> None:
    session.tell(link.clock.now(), "connection lost", f"{what}; next attempt every {RETRY_S:g} s")
    await link.close()


async def _reconnect(link: Link, session: Session) -> None:
    await asyncio.sleep(RETRY_S)
    try:
        await link.connect()
        session.failing.discard("connection")
        session.tell(link.clock.now(), "connected", "the server answers again")
    except UserError as error:
        if "connection" not in session.failing:  # reported once, tried for ever
            session.failing.add("connection")
            session.tell(link.clock.now(), "not connected", str(error))


async def _first_connection(link: Link, seconds: float | None, asked: Asked, say: Say) -> bool:
    """Connect, and wait for a server that is not there yet; False: stopped, or `seconds` went by."""
    began, warned = time.monotonic(), False
    while not asked.stop and (seconds is None or time.monotonic() - began < seconds):
        try:
            await link.connect()
        except UnreachableError as error:
            if not warned:
                say(f"{error}; next attempt every {RETRY_S:g} s")
            warned = True
            await _until(time.monotonic() + RETRY_S, asked)
        else:
            say(f"connected to {link.form.url}, signed and encrypted")
            return True
    return False


def compensate_opcua(
    exported: Exported,
    connection: Path | None,
    *,
    model: Path,
    folder: Path | None = None,
    trusted: Ed25519PublicKey | None = None,
    out: Path | None = None,
    seconds: float | None = None,
    rule: Rule | None = None,
    acknowledge: bool = False,
    learn: Learner | None = None,
    say: Say = lambda _: None,
) -> Punctuality:
    """Compensate a machine over OPC UA; without a connection file a simulated machine is started as well.

    SIGTERM and SIGINT end the run: state OFF stands at the server, the state is saved. SIGUSR1 acknowledges.

    Raises:
        UserError: see `Link.connect`; a server that is not there yet is waited for.
    """
    warm = Stepper(exported.compiled)  # the kernel is loaded before the first tick is due
    warm.run(np.array([[0.5 * (i.range.low + i.range.high) for i in exported.inputs]]))
    asked = Asked()
    asked.acknowledge = acknowledge

    async def work(form: ConnectionForm, place: Path) -> Punctuality:
        clock = Clock()
        link = Link(form, place, exported, clock)
        _listen(asked)
        if not await _first_connection(link, seconds, asked, say):
            return Punctuality()
        with ThreadPoolExecutor(max_workers=1) as background, other_process() as thinking:
            try:
                session = Session(
                    exported,
                    model=model,
                    folder=folder,
                    trusted=trusted,
                    settings=Settings(tick_s=form.tick_s),
                    rule=rule,
                    save_every_s=exported.compiled.step_s,
                    background=background,
                    thinking=thinking if learn is not None else None,
                    clock=clock,
                    learn=learn,
                    say=say,
                )
            except BaseException:
                await link.close()
                raise
            if out is not None:
                at = session.resume_at if session.resumed is not None else None
                session.opens = partial(_output, session, out, at)
            session.say_beginning()
            found = await run_loop(link, session, seconds, asked)
            say(session.summary())
            return found

    async def demonstration() -> Punctuality:
        from discovery.runtime.opcua_machine import simulated_machine

        with tempfile.TemporaryDirectory() as name:
            async with simulated_machine(exported, Path(name)) as file:
                return await work(read_toml(file, ConnectionForm), Path(name))

    if connection is None:
        found = asyncio.run(demonstration())
    else:
        found = asyncio.run(work(read_toml(connection, ConnectionForm), connection.parent))
    say(str(found))
    return found


def _output(session: Session, out: Path, at: int | None) -> Output:
    return Output(out, header(session.compensator), at, replay=False)


def _listen(asked: Asked) -> None:
    if threading.current_thread() is not threading.main_thread():
        return
    loop = asyncio.get_running_loop()

    def stop() -> None:
        asked.stop = True

    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop)
    loop.add_signal_handler(signal.SIGUSR1, asked.on_acknowledge)
