"""The line to a machine's OPC UA server: readings and offsets, signed and encrypted or not at all."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.runtime.clock import Clock
from discovery.runtime.compensator import Tick
from discovery.runtime.guards import Reading, number
from discovery.runtime.opcua_connect import connected, need_asyncua
from discovery.runtime.opcua_form import ConnectionForm

_NUMBERS = {"Double", "Float", "SByte", "Byte", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"}
SERVER_TIME = "i=2258"  # Server.ServerStatus.CurrentTime, of every server


@dataclass
class Seen:
    """What the machine says in a tick."""

    readings: dict[str, Reading] = field(default_factory=dict)
    enabled: bool = True
    part_done: bool = False
    acknowledge: bool = False


class Link:
    """OPC UA client that checks the server's certificate and all nodes, and can connect again."""

    def __init__(
        self, form: ConnectionForm, folder: Path, exported: Exported, clock: Clock | None = None
    ) -> None:
        self.form, self.folder, self.exported = form, folder, exported
        self.clock = clock or Clock()
        self.client: Any = None
        self.kinds: dict[str, Any] = {}
        self.stamps: dict[str, tuple[float, float]] = {}  # last stamp of a node, and that instant inside
        self.alive: tuple[float, float] = (float("-inf"), float("-inf"))  # of the server's own clock
        self.asked = False  # acknowledge, as it was before
        form.check(exported)

    async def connect(self) -> None:
        """Connect, and check types and rights of all nodes.

        Raises:
            UnreachableError: no server answers.
            UserError: refused, another server, an unknown node, a wrong type, a node that cannot be written.
        """
        client = await connected(self.form, self.folder)
        try:
            await self._check_nodes(client, need_asyncua().ua)
        except BaseException:
            with contextlib.suppress(Exception):
                await client.disconnect()
            raise
        self.client = client

    async def _check_nodes(self, client: Any, ua: Any) -> None:
        form = self.form
        wanted = {n: (i, _NUMBERS, False) for n, i in form.inputs.items()}
        wanted |= {f"error {n}": (i, _NUMBERS, False) for n, i in form.errors.items()}
        wanted |= {n: (i, {"Double", "Float"}, True) for n, i in form.offsets.items()}
        for name, kinds, writes in (
            ("status", {"UInt32"}, True),
            ("heartbeat", {"UInt32"}, True),
            ("message", {"String"}, True),
            ("enable", {"Boolean"}, False),
            ("part_done", {"Boolean"}, False),
            ("acknowledge", {"Boolean"}, False),
        ):
            if getattr(form, name) is not None:
                wanted[name] = (getattr(form, name), kinds, writes)
        for name, (node_id, kinds, writes) in wanted.items():
            try:
                node = client.get_node(node_id)
                kind = ua.VariantType((await node.read_data_type_as_variant_type()).value)
            except Exception:
                raise UserError(
                    f"{form.url}: there is no variable {node_id} for '{name}'; correct the connection file "
                    "(`discovery opcua browse` lists the nodes)"
                ) from None
            if kind.name not in kinds:
                raise UserError(
                    f"{form.url}: {node_id} for '{name}' is of type {kind.name}, not "
                    f"{' or '.join(sorted(kinds))}; name another node"
                )
            if writes and ua.AccessLevel.CurrentWrite not in await node.get_user_access_level():
                raise UserError(
                    f"{form.url}: {node_id} for '{name}' cannot be written by this "
                    "user; grant write access to it"
                )
            self.kinds[name] = kind

    async def read(self) -> Seen:
        """Readings of all inputs and measured errors on the steady clock, and what the operator wants."""
        ua, form = need_asyncua().ua, self.form
        nodes = {**form.inputs, **{f"error {n}": i for n, i in form.errors.items()}, "": SERVER_TIME}
        for name in ("enable", "part_done", "acknowledge"):
            if getattr(form, name) is not None:
                nodes[f"want {name}"] = getattr(form, name)
        ids = [ua.NodeId.from_string(node_id) for node_id in nodes.values()]
        values = dict(
            zip(nodes, await self.client.uaclient.read_attributes(ids, ua.AttributeIds.Value), strict=True)
        )
        now = self.clock.now()
        self._is_alive(values[""], now)
        seen = Seen({n: self._reading(n, values[n], now) for n in form.inputs})
        for name in form.errors:
            seen.readings[name] = self._reading(f"error {name}", values[f"error {name}"], now, measured=True)
        wants = {n: _content(values.get(f"want {n}")) is True for n in ("enable", "part_done", "acknowledge")}
        seen.enabled, seen.part_done = form.enable is None or wants["enable"], wants["part_done"]
        seen.acknowledge, self.asked = wants["acknowledge"] and not self.asked, wants["acknowledge"]
        return seen

    def _is_alive(self, value: Any, now: float) -> None:
        """When the server's own clock last moved."""
        stamp = _content(value)
        seconds = _seconds(stamp) if isinstance(stamp, datetime) else None
        if seconds is not None and seconds != self.alive[0]:
            self.alive = (seconds, now)

    def _reading(self, name: str, value: Any, now: float, *, measured: bool = False) -> Reading:
        """A data value on the steady clock: as old as the server says when its stamp first came, and older
        with every second that the stamp stands still.
        """
        source, server = _seconds(value.SourceTimestamp), _seconds(value.ServerTimestamp)
        if source is None:
            return Reading(None, 0.0, False)
        if name not in self.stamps or self.stamps[name][0] != source:
            age = server - source if server is not None else now - self.clock.inside(source)
            self.stamps[name] = (source, now - age)
        at = self.stamps[name][1]
        if self.form.stamps == "change" and not measured:
            at = max(at, self.alive[1])
        return Reading(_content(value), at, value.StatusCode.is_good())

    async def offsets(self) -> dict[str, float]:
        """The offsets at the server now: a compensation without a saved state begins there."""
        found = {}
        for name, node_id in self.form.offsets.items():
            found[name] = number(await self.client.get_node(node_id).read_value())
        return found

    async def write(self, tick: Tick) -> None:
        """Offsets, status word, heartbeat and the last event."""
        ua, form = need_asyncua().ua, self.form
        values: dict[str, tuple[str, float | int | str]] = {
            n: (i, tick.offsets[n]) for n, i in form.offsets.items()
        }
        if form.status:
            values["status"] = (form.status, tick.status)
        if form.heartbeat:
            values["heartbeat"] = (form.heartbeat, tick.heartbeat & 0xFFFFFFFF)
        if form.message and tick.events:
            values["message"] = (form.message, str(tick.events[-1]))
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


def _content(value: Any) -> Any:
    return None if value is None or value.Value is None else value.Value.Value


def _seconds(stamp: datetime | None) -> float | None:
    if stamp is None:
        return None
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
