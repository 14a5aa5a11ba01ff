"""The line to a machine's OPC UA server: what a connection file says, and readings and offsets over it."""

from __future__ import annotations

import asyncio
import contextlib
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pydantic import Field

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.extras import need
from discovery.runtime.compensator import Tick
from discovery.runtime.guards import Reading
from discovery.schema import Strict

_NUMBERS = {"Double", "Float", "SByte", "Byte", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"}


class ConnectionForm(Strict):
    """A connection file (TOML); paths are relative to it."""

    url: str = Field(description="opc.tcp://host:port/...")
    application_uri: str = Field("urn:discovery:compensator", description="as it stands in the certificate")
    certificate: str = Field(description="own certificate (DER or PEM)")
    private_key: str = Field(description="own private key (PEM)")
    server_certificate: str = Field(description="certificate that the server must have (DER or PEM)")
    tick_s: float = Field(1.0, ge=0.05, le=60.0, description="time between ticks in s")
    inputs: dict[str, str] = Field(description="node id of each input of the model")
    offsets: dict[str, str] = Field(
        description="node id of each offset, Double or Float, by name of the error"
    )
    status: str | None = Field(None, description="node id of the status word, UInt32")
    heartbeat: str | None = Field(None, description="node id of the heartbeat, UInt32")
    enable: str | None = Field(None, description="node id of a Boolean: compensate or not")


class Link:
    """A connection that checks what it is connected to, and comes back when it is lost."""

    def __init__(self, form: ConnectionForm, folder: Path, exported: Exported) -> None:
        self.form, self.folder, self.exported = form, folder, exported
        self.client: Any = None
        self.kinds: dict[str, Any] = {}
        _check_names(form, exported)

    async def connect(self) -> None:
        """Connect, and check types and rights of all nodes.

        Raises:
            UserError: refused, not reachable, an unknown node, a wrong type, a node that cannot be written.
        """
        asyncua = need_asyncua()
        from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

        client = asyncua.Client(self.form.url, timeout=4)
        client.application_uri = self.form.application_uri
        files = {
            name: self.folder / getattr(self.form, name)
            for name in ("certificate", "private_key", "server_certificate")
        }
        for path in files.values():
            if not path.is_file():
                raise UserError(
                    f"{path}: there is no such file; the connection is signed and encrypted and needs it"
                )
        try:
            await client.set_security(
                SecurityPolicyBasic256Sha256,
                str(files["certificate"]),
                str(files["private_key"]),
                server_certificate=str(files["server_certificate"]),
                mode=asyncua.ua.MessageSecurityMode.SignAndEncrypt,
            )
            await client.connect()
        except Exception as error:
            with contextlib.suppress(Exception):
                await client.disconnect()
            raise UserError(_refusal(self.form.url, error)) from None
        try:
            await self._check_nodes(client, asyncua.ua)
        except BaseException:
            with contextlib.suppress(Exception):
                await client.disconnect()
            raise
        self.client = client

    async def _check_nodes(self, client: Any, ua: Any) -> None:
        wanted = {**{n: (i, _NUMBERS, False) for n, i in self.form.inputs.items()}}
        wanted |= {n: (i, {"Double", "Float"}, True) for n, i in self.form.offsets.items()}
        for name, kinds, writes in (
            ("status", {"UInt32"}, True),
            ("heartbeat", {"UInt32"}, True),
            ("enable", {"Boolean"}, False),
        ):
            if getattr(self.form, name) is not None:
                wanted[name] = (getattr(self.form, name), kinds, writes)
        for name, (node_id, kinds, writes) in wanted.items():
            try:
                node = client.get_node(node_id)
                kind = ua.VariantType((await node.read_data_type_as_variant_type()).value)
            except Exception:
                raise UserError(
                    f"{self.form.url}: there is no variable {node_id} for '{name}'; mend the connection file"
                ) from None
            if kind.name not in kinds:
                raise UserError(
                    f"{self.form.url}: {node_id} for '{name}' is of type {kind.name}, not "
                    f"{' or '.join(sorted(kinds))}; name another node"
                )
            if writes and ua.AccessLevel.CurrentWrite not in await node.get_user_access_level():
                raise UserError(
                    f"{self.form.url}: {node_id} for '{name}' cannot be written by this "
                    "user; grant write access to it"
                )
            self.kinds[name] = kind

    async def read(self) -> tuple[dict[str, Reading], bool]:
        """Readings of all inputs on the clock of this computer, and whether compensation is enabled."""
        ua = need_asyncua().ua
        names = list(self.form.inputs)
        ids = [ua.NodeId.from_string(self.form.inputs[name]) for name in names]
        ids += [ua.NodeId.from_string(self.form.enable)] if self.form.enable else []
        values = await self.client.uaclient.read_attributes(ids, ua.AttributeIds.Value)
        now = time.time()
        readings = {name: _reading(value, now) for name, value in zip(names, values, strict=False)}
        enabled = self.form.enable is None or (
            values[-1].Value is not None and values[-1].Value.Value is True
        )
        return readings, enabled

    async def write(self, tick: Tick) -> None:
        """Offsets, status word and heartbeat."""
        ua = need_asyncua().ua
        values: dict[str, tuple[str, float | int]] = {
            n: (i, tick.offsets[n]) for n, i in self.form.offsets.items()
        }
        if self.form.status:
            values["status"] = (self.form.status, tick.status)
        if self.form.heartbeat:
            values["heartbeat"] = (self.form.heartbeat, tick.heartbeat & 0xFFFFFFFF)
        ids = [ua.NodeId.from_string(node_id) for node_id, _ in values.values()]
        data = [ua.DataValue(ua.Variant(value, self.kinds[name])) for name, (_, value) in values.items()]
        for code in await self.client.uaclient.write_attributes(ids, data, ua.AttributeIds.Value):
            code.check()

    async def close(self) -> None:
        """Disconnect, whatever state the connection is in."""
        client, self.client = self.client, None
        if client is not None:
            with contextlib.suppress(Exception):
                await asyncio.wait_for(client.disconnect(), 4.0)


def _check_names(form: ConnectionForm, exported: Exported) -> None:
    for name in (i.name for i in exported.inputs):
        if name not in form.inputs:
            raise UserError(
                f"the connection names no node for input '{name}' of the model; add it under [inputs]"
            )
    errors = {o.name for o in exported.outputs if o.role == "error"}
    for name in form.offsets:
        if name not in errors:
            raise UserError(
                f"the connection names an offset '{name}', which the model does not give "
                f"({', '.join(sorted(errors))})"
            )


def _reading(value: Any, now: float) -> Reading:
    """A data value: age by the server's own clock where it says it, so that clocks need not agree."""
    source, server = _seconds(value.SourceTimestamp), _seconds(value.ServerTimestamp)
    if source is None:
        return Reading(None, 0.0, False)
    age = (server if server is not None else now) - source
    raw = None if value.Value is None else value.Value.Value
    return Reading(
        raw,
        now - age if server is not None and abs(server - now) > 60.0 else source,
        value.StatusCode.is_good(),
    )


def _seconds(stamp: datetime | None) -> float | None:
    if stamp is None:
        return None
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


def _refusal(url: str, error: Exception) -> str:
    text = f"{type(error).__name__} {error}".strip()[:160]
    if any(word in text for word in ("Certificate", "certificate", "Security")):
        what = f"refused because of a certificate ({text}); each side must trust the certificate of the other"
        return f"{url}: the connection is {what}"
    if isinstance(error, OSError | TimeoutError | asyncio.TimeoutError):
        advice = "check address and port, and that the server trusts this certificate"
        return f"{url}: no OPC UA server answers ({text}); {advice}"
    return f"{url}: the connection is refused ({text}); check the certificates and the user's rights"


def need_asyncua() -> Any:
    """The package asyncua. Raises UserError where it is not installed."""
    return need("asyncua", "opcua", "OPC UA needs")
