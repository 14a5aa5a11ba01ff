"""OPC UA against the simulated machine server: signed and encrypted, checked before anything is written."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.files import read_toml
from discovery.runtime.clock import Clock
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.opcua import Punctuality, _first_connection, run_loop
from discovery.runtime.opcua_form import CLIENT_URI, ConnectionForm
from discovery.runtime.opcua_link import Link
from discovery.runtime.opcua_machine import simulated_machine
from discovery.runtime.opcua_tools import browse, fetch_certificate, make_certificate
from discovery.runtime.session import Session
from discovery.runtime.signals import Asked


@pytest.fixture(scope="module")
def place(exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a machine server that runs beside the tests, with its connection file."""
    folder, ready, done = tmp_path_factory.mktemp("machine"), threading.Event(), threading.Event()

    async def serve() -> None:
        async with simulated_machine(exported, folder, update_s=0.1):
            for name, uri in (("stranger", CLIENT_URI), ("impostor", "urn:discovery:machine")):
                make_certificate(folder, name, uri)
            ready.set()
            while not done.is_set():
                await asyncio.sleep(0.05)

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    assert ready.wait(60)
    yield folder
    done.set()
    thread.join()


@pytest.fixture
def form(place: Path) -> ConnectionForm:
    return read_toml(place / "connection.toml", ConnectionForm)


def test_the_loop_reads_compensates_and_writes(exported: Exported, place: Path, form: ConnectionForm) -> None:
    said: list[str] = []
    form = form.model_copy(update={"tick_s": 0.2})

    async def work() -> tuple[Punctuality, dict[str, Any], Session]:
        link = Link(form, place, exported)
        await link.connect()
        session = Session(exported, settings=Settings(tick_s=0.2), say=said.append)
        found = await run_loop(link, session, 2.0)
        await link.connect()
        written = {}
        for name, node in {
            **form.offsets,
            "heartbeat": str(form.heartbeat),
            "status": str(form.status),
            "message": str(form.message),
        }.items():
            written[name] = await link.client.get_node(node).read_value()
        await link.close()
        return found, written, session

    found, written, session = asyncio.run(work())
    assert found.ticks >= 9
    assert written["heartbeat"] == session.compensator.heartbeat
    assert int(written["status"]) & 0xFF == session.compensator.state.value
    assert int(written["status"]) & 0xFF == 0  # a compensation that ends says OFF
    assert "COLD -> OFF: compensation is switched off" in str(written["message"])
    assert {n: written[n] for n in session.compensator.names} == dict(
        zip(session.compensator.names, session.compensator.offsets, strict=True)
    )
    assert [text.split(": ")[0].split(" ", 2)[2] for text in said] == ["OFF -> COLD", "COLD -> OFF"]


def refused(form: ConnectionForm, place: Path, exported: Exported, change: Mapping[str, Any]) -> str:
    async def work() -> None:
        await Link(form.model_copy(update=change), place, exported).connect()

    with pytest.raises(UserError) as caught:
        asyncio.run(work())
    return str(caught.value)


def test_a_certificate_that_is_not_trusted_is_refused(
    place: Path, form: ConnectionForm, exported: Exported
) -> None:
    said = refused(form, place, exported, {"certificate": "stranger.der", "private_key": "stranger.pem"})
    assert "certificate" in said


def test_a_server_that_is_not_the_one_named_is_refused(
    place: Path, form: ConnectionForm, exported: Exported
) -> None:
    said = refused(form, place, exported, {"server_certificate": "impostor.der"})
    assert "the certificate of the server (SHA-1 " in said
    assert "impostor.der" in said


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda f: {"inputs": {**f.inputs, "T_env": f.enable}}, "'T_env' is of type Boolean, not"),
        (
            lambda f: {"offsets": {**f.offsets, "E_Z0T": f.status}},
            "'E_Z0T' is of type UInt32, not Double or Float",
        ),
        (lambda f: {"offsets": {**f.offsets, "E_Z0T": f.inputs["T_env"]}}, "'E_Z0T' cannot be written"),
        (
            lambda f: {"inputs": {**f.inputs, "T_env": "ns=9;s=nowhere"}},
            "no variable ns=9;s=nowhere for 'T_env'",
        ),
        (lambda f: {"inputs": {"T_env": f.inputs["T_env"]}}, "no node for input"),
        (lambda f: {"offsets": {"E_X0C": f.status}}, "offset 'E_X0C', which the model does not give"),
        (lambda _: {"url": "opc.tcp://127.0.0.1:9/nobody"}, "no OPC UA server answers"),
        (lambda f: {"errors": {"E_X0C": f.status}}, "measured error 'E_X0C', which the model does not give"),
        (lambda _: {"url": "opc.tcp://me:secret@127.0.0.1:9/"}, "holds a user or a password"),
        (lambda _: {"application_uri": "urn:other"}, "application_uri 'urn:other' is not the one in"),
        (lambda _: {"user": "me"}, "one of password_file and password_env"),
        (lambda _: {"user": "me", "password_env": "NOT_SET_ANYWHERE"}, "no variable NOT_SET_ANYWHERE"),
        (lambda _: {"private_key": "none.pem"}, "there is no such file"),
    ],
)
def test_a_mistake_in_the_connection_is_a_sentence(
    place: Path,
    form: ConnectionForm,
    exported: Exported,
    change: Callable[[ConnectionForm], dict[str, Any]],
    sentence: str,
) -> None:
    assert sentence in refused(form, place, exported, change(form))


def test_a_lost_connection_is_held_and_found_again(
    exported: Exported, place: Path, form: ConnectionForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("discovery.runtime.opcua.RETRY_S", 0.2)
    said: list[str] = []
    form = form.model_copy(update={"tick_s": 0.1})

    async def work() -> Session:
        link = Link(form, place, exported)
        await link.connect()
        session = Session(exported, settings=Settings(tick_s=0.1), say=said.append)

        async def cut() -> None:
            await asyncio.sleep(0.5)
            link.client.uaclient.protocol.transport.abort()

        cutting = asyncio.create_task(cut())
        await run_loop(link, session, 4.0)
        await cutting
        return session

    began = time.monotonic()
    session = asyncio.run(work())
    assert time.monotonic() - began < 15
    assert sum("connection lost" in text for text in said) == 1
    assert sum("connected: the server answers again" in text for text in said) == 1
    assert session.compensator.heartbeat >= 30


class Value:
    """A data value as a server gives it; the server's own clock moves or stands."""

    def __init__(self, content: object, source: float, server: float) -> None:
        self.SourceTimestamp = datetime.fromtimestamp(source, UTC)
        self.ServerTimestamp = datetime.fromtimestamp(server, UTC)
        self.StatusCode = type("Good", (), {"is_good": lambda _: True})()
        self.Value = type("Variant", (), {"Value": content})()


def stepped_clock() -> tuple[Clock, dict[str, float]]:
    times = {"steady": 100.0, "wall": 1.8e9}
    return Clock(lambda: times["steady"], lambda: times["wall"], "boot"), times


def test_a_server_that_stands_still_grows_old(exported: Exported, place: Path, form: ConnectionForm) -> None:
    """Its stamps and its own clock stand: 240 h later the value had still counted as fresh."""
    clock, times = stepped_clock()
    link = Link(form, place, exported, clock)
    ages = []
    for _ in range(3):
        found = link._reading("T_env", Value(22.0, 5e8, 5e8), clock.now())  # another year: its own clock
        ages.append(clock.now() - found.time)
        times["steady"] += 3600.0
        times["wall"] += 3600.0
    assert ages == pytest.approx([0.0, 3600.0, 7200.0])
    fresh = link._reading("T_env", Value(22.0, 5e8 + 9, 5e8 + 10), clock.now())
    assert clock.now() - fresh.time == pytest.approx(1.0)


def test_stamps_of_changes_are_as_old_as_the_server_is_silent(
    exported: Exported, place: Path, form: ConnectionForm
) -> None:
    clock, times = stepped_clock()
    link = Link(form.model_copy(update={"stamps": "change"}), place, exported, clock)
    for k in range(4):
        link._is_alive(Value(datetime.fromtimestamp(5e8 + min(k, 2), UTC), 5e8, 5e8), clock.now())
        found = link._reading("pump", Value(1.0, 5e8, 5e8 + k), clock.now())
        times["steady"] += 60.0
    assert clock.now() - 60.0 - found.time == pytest.approx(60.0)  # alive until the third of four ticks


def test_the_wall_clock_may_be_set() -> None:
    clock, times = stepped_clock()
    clock.jumped()
    before = clock.now()
    times["steady"] += 1.0
    times["wall"] += 86_401.0
    assert clock.jumped() == pytest.approx(86_400.0)
    assert clock.jumped() == 0.0
    assert clock.now() == before + 1.0
    assert clock.inside(times["wall"]) == pytest.approx(clock.now())
    saved = clock.saved()
    times["steady"] += 500.0
    again = Clock(lambda: times["steady"], lambda: times["wall"] - 1e6, "boot")
    again.resume(saved)
    assert again.now() == pytest.approx(before + 501.0)  # the same start of the computer: the gap is known
    other = Clock(lambda: times["steady"], lambda: times["wall"], "another boot")
    other.resume(saved)
    assert other.now() == times["wall"]


def test_errors_under_the_offsets_stand_with_what_was_taken_off(
    exported: Exported, place: Path, form: ConnectionForm
) -> None:
    form = form.model_copy(update={"tick_s": 0.2, "errors": {"E_Y0C": form.inputs["T_env"]}})

    async def work() -> dict[str, Reading]:
        link = Link(form, place, exported)
        await link.connect()
        session = Session(exported, settings=Settings(tick_s=0.2))
        session.compensator.offsets[session.compensator.names.index("E_Y0C")] = -7.0
        kept: dict[str, Reading] = {}
        tick = session.tick

        def spy(readings: Mapping[str, Reading], now: float, **options: bool) -> Any:
            kept.update(readings)
            return tick(readings, now, **options)

        session.tick = spy  # type: ignore[method-assign]
        await run_loop(link, session, 0.3)
        return kept

    kept = asyncio.run(work())
    assert isinstance(kept["E_Y0C"].value, float)
    applied = kept["E_Y0C_applied"].value
    assert isinstance(applied, float)
    assert abs(applied) < 7.5


def test_a_stop_writes_off_and_a_start_goes_on_from_the_offsets_of_the_server(
    exported: Exported, place: Path, form: ConnectionForm
) -> None:
    form, asked = form.model_copy(update={"tick_s": 0.1}), Asked()

    async def work() -> tuple[int, float]:
        link = Link(form, place, exported)
        await link.connect()
        ua = link.client
        node = ua.get_node(form.offsets["E_Y0C"])
        from asyncua import ua as types

        await node.write_value(12.5, types.VariantType.Double)
        session = Session(exported, settings=Settings(tick_s=0.1))
        asyncio.get_running_loop().call_later(0.5, setattr, asked, "stop", True)
        await run_loop(link, session, None, asked)
        await link.connect()
        status = await link.client.get_node(form.status).read_value()
        left = await link.client.get_node(form.offsets["E_Y0C"]).read_value()
        await link.close()
        return int(status), float(left)

    status, left = asyncio.run(work())
    assert status & 0xFF == 0
    assert left == pytest.approx(12.5, abs=0.1)  # no step at the start, none at the stop


def test_nodes_can_be_browsed_and_a_certificate_fetched(
    place: Path, form: ConnectionForm, tmp_path: Path
) -> None:
    async def work() -> tuple[list[str], str]:
        lines = [line async for line in browse(form, place, "i=85", 6)]
        return lines, await fetch_certificate(form.url, tmp_path / "server.der")

    lines, fingerprint = asyncio.run(work())
    [own] = [line for line in lines if "/offset E_Y0C" in line]
    assert own.split()[:2] == ["ns=2;s=offset", "E_Y0C"] or "Double" in own
    assert "read, write" in own
    assert (tmp_path / "server.der").read_bytes() == (place / "server.der").read_bytes()
    assert len(fingerprint) == 40
    with pytest.raises(UserError, match="this file exists"):
        make_certificate(place, "client")


def test_a_server_that_is_not_there_yet_is_waited_for(
    exported: Exported, place: Path, form: ConnectionForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("discovery.runtime.opcua.RETRY_S", 0.1)
    said: list[str] = []
    late = form.model_copy(update={"url": "opc.tcp://127.0.0.1:9/"})

    async def work() -> bool:
        link = Link(late, place, exported)

        async def appear() -> None:
            await asyncio.sleep(0.5)
            link.form = form

        task = asyncio.create_task(appear())
        found = await _first_connection(link, 20.0, Asked(), said.append)
        await task
        await link.close()
        return found

    assert asyncio.run(work())
    assert len(said) == 2
    assert "next attempt every" in said[0]
    assert said[1].startswith("connected to")
