"""A simulated machine server for trying the compensator over OPC UA: inputs that move within the trained
ranges, nodes for the offsets in a namespace of their own, access for one certificate alone."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from discovery.export.document import Exported, Input
from discovery.files import write_toml
from discovery.runtime.opcua_connect import need_asyncua
from discovery.runtime.opcua_form import CLIENT_URI
from discovery.runtime.opcua_tools import make_certificate

NAMESPACE = "urn:discovery:offsets"
SERVER_URI = "urn:discovery:machine"


@contextlib.asynccontextmanager
async def simulated_machine(exported: Exported, folder: Path, update_s: float = 1.0) -> AsyncIterator[Path]:
    """Run the server while the context lasts; yields the connection file of a client that it trusts."""
    asyncua = need_asyncua()
    logging.getLogger("asyncua").setLevel(logging.ERROR)
    ua = asyncua.ua
    from asyncua.common.utils import ServiceError
    from asyncua.crypto.uacrypto import load_certificate

    make_certificate(folder, "server", SERVER_URI)
    make_certificate(folder, "client", CLIENT_URI)
    trusted = await load_certificate(folder / "client.der")

    async def only_the_client(certificate: Any, description: Any) -> None:  # noqa: ARG001
        if certificate != trusted:
            raise ServiceError(ua.StatusCodes.BadCertificateUntrusted)

    server = asyncua.Server()
    await server.init()
    url = f"opc.tcp://127.0.0.1:{_free_port()}/machine"
    server.set_endpoint(url)
    await server.set_application_uri(SERVER_URI)
    server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
    server.set_certificate_validator(only_the_client)
    await server.load_certificate(str(folder / "server.der"))
    await server.load_private_key(str(folder / "server.pem"))
    space = await server.register_namespace(NAMESPACE)
    machine = await server.nodes.objects.add_object(ua.NodeId("Machine", space), "Machine")
    kinds = ua.VariantType
    inputs = {
        i.name: await _variable(ua, machine, space, i.name, _signal(i, k, 0.0), kinds.Double)
        for k, i in enumerate(exported.inputs)
    }
    names = [o.name for o in exported.outputs if o.role == "error"]
    offsets = {n: await _variable(ua, machine, space, f"offset {n}", 0.0, kinds.Double, True) for n in names}
    status = await _variable(ua, machine, space, "status", 0, kinds.UInt32, True)
    heartbeat = await _variable(ua, machine, space, "heartbeat", 0, kinds.UInt32, True)
    message = await _variable(ua, machine, space, "message", "", kinds.String, True)
    part_done = await _variable(ua, machine, space, "part_done", False, kinds.Boolean)
    acknowledge = await _variable(ua, machine, space, "acknowledge", False, kinds.Boolean, True)
    enable = await _variable(ua, machine, space, "enable", True, kinds.Boolean)
    file = folder / "connection.toml"
    write_toml(
        file,
        {
            "url": url,
            "certificate": "client.der",
            "private_key": "client.pem",
            "server_certificate": "server.der",
            "application_uri": CLIENT_URI,
            "status": status.nodeid.to_string(),
            "heartbeat": heartbeat.nodeid.to_string(),
            "message": message.nodeid.to_string(),
            "enable": enable.nodeid.to_string(),
            "part_done": part_done.nodeid.to_string(),
            "acknowledge": acknowledge.nodeid.to_string(),
            "inputs": {name: node.nodeid.to_string() for name, node in inputs.items()},
            "offsets": {name: node.nodeid.to_string() for name, node in offsets.items()},
        },
    )

    async def live() -> None:
        time = 0.0
        while True:
            for k, i in enumerate(exported.inputs):
                await inputs[i.name].write_value(_signal(i, k, time), kinds.Double)
            await asyncio.sleep(update_s)
            time += update_s

    async with server:
        task = asyncio.create_task(live())
        try:
            yield file
        finally:
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task


async def _variable(
    ua: Any, parent: Any, space: int, name: str, value: object, kind: Any, writable: bool = False
) -> Any:
    node = await parent.add_variable(ua.NodeId(name, space), name, value, kind)
    if writable:
        await node.set_writable()
    return node


def _signal(spec: Input, index: int, time: float) -> float:
    """Return an input within its trained range: a held input switches every few minutes, a temperature
    drifts.
    """
    low, high = spec.range.low, spec.range.high
    if spec.between == "held":
        level = (0.0, 1.0, 0.5, 1.0, 0.25)[int(time / 120.0 + index) % 5]
        if spec.role == "fluid flow":
            level = float(level > 0.0)
        return low + level * (high - low)
    return 0.5 * (low + high) + 0.3 * (high - low) * math.sin(2 * math.pi * time / 3600.0 + index)


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])
