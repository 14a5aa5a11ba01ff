"""OPC UA against the simulated machine server: signed and encrypted, checked before anything is written."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.files import read_toml
from discovery.runtime.compensator import Settings
from discovery.runtime.opcua import Punctuality, run_loop
from discovery.runtime.opcua_link import ConnectionForm, Link
from discovery.runtime.opcua_machine import CLIENT_URI, make_certificate, simulated_machine
from discovery.runtime.session import Session


@pytest.fixture(scope="module")
def place(exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a machine server that runs beside the tests, with its connection file."""
    folder, ready, done = tmp_path_factory.mktemp("machine"), threading.Event(), threading.Event()

    async def serve() -> None:
        async with simulated_machine(exported, folder, update_s=0.1):
            for name, uri in (("stranger", CLIENT_URI), ("impostor", "urn:discovery:machine")):
                await make_certificate(folder, name, uri)
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


def test_the_loop_reads_compensates_and_writes(
    exported: Exported, model_file: Path, place: Path, form: ConnectionForm
) -> None:
    said: list[str] = []
    form = form.model_copy(update={"tick_s": 0.1})

    async def work() -> tuple[Punctuality, dict[str, float], Session]:
        link = Link(form, place, exported)
        await link.connect()
        session = Session(exported, model=model_file, settings=Settings(tick_s=0.1))
        found = await run_loop(link, session, 2.0, said.append)
        await link.connect()
        written = {}
        for name, node in {
            **form.offsets,
            "heartbeat": str(form.heartbeat),
            "status": str(form.status),
        }.items():
            written[name] = await link.client.get_node(node).read_value()
        await link.close()
        return found, written, session

    found, written, session = asyncio.run(work())
    assert found.ticks >= 19
    assert written["heartbeat"] == session.compensator.heartbeat
    assert int(written["status"]) & 0xFF == session.compensator.state.value
    assert {n: written[n] for n in session.compensator.names} == dict(
        zip(session.compensator.names, session.compensator.offsets, strict=True)
    )
    assert any(session.compensator.offsets)
    assert said == []


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
    assert "refused" in said or "no OPC UA server" in said


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
        session = Session(exported, settings=Settings(tick_s=0.1))

        async def cut() -> None:
            await asyncio.sleep(0.5)
            link.client.uaclient.protocol.transport.abort()

        cutting = asyncio.create_task(cut())
        await run_loop(link, session, 4.0, said.append)
        await cutting
        return session

    began = time.monotonic()
    session = asyncio.run(work())
    assert time.monotonic() - began < 15
    assert any("lost" in text for text in said)
    assert said[-1] == "connected again"
    assert session.compensator.heartbeat >= 30
