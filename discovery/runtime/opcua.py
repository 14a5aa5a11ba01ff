"""OPC UA: readings from a machine's server, offsets back to it, signed and encrypted or not at all."""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.stepper import Stepper
from discovery.files import read_toml
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.opcua_link import ConnectionForm, Link
from discovery.runtime.session import Say, Session

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

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
            f"{self.ticks} ticks, {100 * self.share:.2f} % in time, {mean:.1f} ms of work each, worst "
            f"{1e3 * self.worst_s:.0f} ms; "
            + ", ".join(f"{name} {count}" for name, count in self.states.items())
        )


async def run_loop(link: Link, session: Session, seconds: float | None, say: Say) -> Punctuality:
    """Tick for `seconds` (None: until stopped); a lost connection is tried again beside the ticks."""
    tick_s, found = link.form.tick_s, Punctuality()
    readings: Mapping[str, Reading] = {}
    enabled, again = True, None
    began = due = time.monotonic()
    try:
        while seconds is None or due - began < seconds:
            start = time.monotonic()
            if link.client is not None:
                try:
                    readings, enabled = await asyncio.wait_for(link.read(), 0.8 * tick_s)
                except Exception as error:
                    say(f"the connection is lost ({type(error).__name__}); trying again")
                    await link.close()
            if link.client is None and (again is None or again.done()):
                again = asyncio.create_task(_reconnect(link, say))
            # values that are no longer renewed grow too old by themselves: the guards see to it
            tick = session.tick(readings, time.time(), enabled=enabled)
            if link.client is not None:
                try:
                    await asyncio.wait_for(link.write(tick), 0.8 * tick_s)
                except Exception as error:
                    say(f"the offsets cannot be written ({type(error).__name__}); trying again")
                    await link.close()
            end = time.monotonic()
            found.ticks += 1
            found.late += start - due > 0.1 * tick_s or end > due + tick_s
            found.worst_s, found.work_s = max(found.worst_s, end - due), found.work_s + end - start
            found.states[tick.state.name] = found.states.get(tick.state.name, 0) + 1
            due += tick_s
            if end > due + 10 * tick_s:  # after a sleep of the computer: no burst of ticks
                due = end
            await asyncio.sleep(max(0.0, due - time.monotonic()))
    finally:
        if again is not None:
            again.cancel()
        session.close(time.time())
        await link.close()
    return found


async def _reconnect(link: Link, say: Say) -> None:
    await asyncio.sleep(RETRY_S)
    try:
        await link.connect()
        say("connected again")
    except UserError as error:
        say(str(error))


def compensate_opcua(
    exported: Exported,
    connection: Path | None,
    *,
    model: Path,
    folder: Path | None = None,
    trusted: Ed25519PublicKey | None = None,
    seconds: float | None = None,
    shadow_hours: float = 24.0,
    say: Say = lambda _: None,
) -> Punctuality:
    """Compensate a machine over OPC UA; without a connection file a simulated machine is started beside.

    Raises:
        UserError: see `Link.connect`.
    """
    from discovery.runtime.shadow import Rule

    warm = Stepper(exported.compiled)  # the kernel is loaded before the first tick is due
    warm.run(np.array([[0.5 * (i.range.low + i.range.high) for i in exported.inputs]]))

    async def work(form: ConnectionForm, place: Path) -> Punctuality:
        link = Link(form, place, exported)
        await link.connect()
        say(f"connected to {form.url}, signed and encrypted")
        with ThreadPoolExecutor(max_workers=1) as beside:
            session = Session(
                exported,
                model=model,
                folder=folder,
                trusted=trusted,
                settings=Settings(tick_s=form.tick_s),
                rule=Rule(hours=shadow_hours),
                save_every_s=exported.compiled.step_s,
                beside=beside,
                say=say,
            )
            return await run_loop(link, session, seconds, say)

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
