"""The line to a machine's OPC UA server: readings and offsets, signed and encrypted or not at all."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.extras import need
from discovery.runtime.clock import Clock
from discovery.runtime.compensator import Tick
from discovery.runtime.guards import Reading, number
from discovery.runtime.opcua_form import ConnectionForm

_NUMBERS = {"Double", "Float", "SByte", "Byte", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"}
SERVER_TIME = "i=2258"  # Server.ServerStatus.CurrentTime, of every server


class UnreachableError(UserError):
    """The server does not answer (yet); what else is wrong nobody knows."""


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
                    f"{form.url}: there is no variable {node_id} for '{name}'; mend the connection file "
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
        """The offsets that stand at the server now: where a compensation without a saved state begins."""
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


async def connected(form: ConnectionForm, folder: Path) -> Any:
    """A client with an open session at the server that the connection file names.

    Raises:
        UnreachableError: no server answers.
        UserError: a file that is not there, another certificate than expected, a user that is refused.
    """
    asyncua = need_asyncua()
    from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

    form.check_address()
    files = {
        name: folder / getattr(form, name) for name in ("certificate", "private_key", "server_certificate")
    }
    for path in files.values():
        if not path.is_file():
            raise UserError(
                f"{path}: there is no such file; the connection is signed and encrypted and needs it "
                "(`discovery opcua certificate` makes the own ones and fetches that of the server)"
            )
    password = form.password(folder)
    await _check_own(form, files["certificate"])
    await _check_server(form, files["server_certificate"])
    client = asyncua.Client(form.url, timeout=4)
    client.application_uri = form.application_uri
    if form.user is not None:
        client.set_user(form.user)
        client.set_password(password)
    try:
        await client.set_security(
            SecurityPolicyBasic256Sha256,
            str(files["certificate"]),
            str(files["private_key"]),
            server_certificate=str(files["server_certificate"]),
            mode=asyncua.ua.MessageSecurityMode.SignAndEncrypt,
        )
        await client.connect(auto_reconnect=False)
    except Exception as error:
        with contextlib.suppress(Exception):
            await client.disconnect()
        raise UserError(_refusal(form, error)) from None
    return client


async def server_certificates(url: str) -> list[bytes]:
    """The certificates (DER) that a server shows, before anything is trusted.

    Raises:
        UnreachableError: no server answers.
    """
    asyncua = need_asyncua()
    client = asyncua.Client(url, timeout=4)
    try:
        endpoints = await client.connect_and_get_server_endpoints()
    except Exception as error:
        text = f"{type(error).__name__} {error}".strip()[:160]
        raise UnreachableError(
            f"{url}: no OPC UA server answers ({text}); check address and port, and that the machine is on"
        ) from None
    found = [e for e in endpoints if e.ServerCertificate]
    if not any(
        e.SecurityPolicyUri.endswith("Basic256Sha256")
        and e.SecurityMode == asyncua.ua.MessageSecurityMode.SignAndEncrypt
        for e in found
    ):
        raise UserError(
            f"{url}: the server offers no Basic256Sha256 with SignAndEncrypt; switch it on at the server"
        )
    return list({bytes(e.ServerCertificate): None for e in found})


async def _check_own(form: ConnectionForm, path: Path) -> None:
    from asyncua.crypto.uacrypto import load_certificate
    from cryptography import x509

    certificate = await load_certificate(path)
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        found = names.get_values_for_type(x509.UniformResourceIdentifier)
    except x509.ExtensionNotFound:
        found = []
    if form.application_uri not in found:
        raise UserError(
            f"application_uri '{form.application_uri}' is not the one in {path} "
            f"({', '.join(found) or 'none'}), "
            "and servers refuse that; make them equal"
        )


async def _check_server(form: ConnectionForm, named: Path) -> None:
    from asyncua.crypto.uacrypto import load_certificate
    from cryptography.hazmat.primitives import hashes, serialization

    shown = await server_certificates(form.url)
    certificate = await load_certificate(named)
    wanted = certificate.public_bytes(serialization.Encoding.DER)
    if not any(one.startswith(wanted) for one in shown):
        from cryptography.x509 import load_der_x509_certificate

        other = load_der_x509_certificate(shown[0]) if shown else None
        print_of_other = other.fingerprint(hashes.SHA1()).hex() if other is not None else "none"
        raise UserError(
            f"{form.url}: the server shows another certificate (SHA-1 {print_of_other}) than {named} (SHA-1 "
            f"{certificate.fingerprint(hashes.SHA1()).hex()}); if the machine has a new one, compare its "
            "fingerprint at the machine and fetch it with `discovery opcua certificate`"
        )


def _content(value: Any) -> Any:
    return None if value is None or value.Value is None else value.Value.Value


def _seconds(stamp: datetime | None) -> float | None:
    if stamp is None:
        return None
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


_REFUSALS: Mapping[str, str] = {
    "BadUserAccessDenied": "user '{user}' or its password is refused; check both at the server",
    "BadIdentityTokenRejected": "user '{user}' or its password is refused; check both at the server",
    "BadIdentityTokenInvalid": "the server does not take this kind of login; name a user and its password",
    "BadCertificateUriInvalid": "application_uri '{uri}' is not that of the own certificate",
    "BadCertificateTimeInvalid": "a certificate is not valid now; check the clocks, or make a new one",
}


def _refusal(form: ConnectionForm, error: Exception) -> str:
    text = f"{type(error).__name__} {error}".strip()[:160]
    for code, sentence in _REFUSALS.items():
        if code in text:
            return f"{form.url}: " + sentence.format(user=form.user, uri=form.application_uri)
    if any(word in text for word in ("Certificate", "certificate", "Security")) or isinstance(
        error,
        OSError | AssertionError,  # asyncua asserts where a server closes the channel
    ):
        return (
            f"{form.url}: the connection is refused, most likely because the server does not trust the "
            f"certificate {form.certificate} ({text}); trust it at the server"
        )
    return f"{form.url}: the connection is refused ({text}); check the certificates and the user's rights"


def need_asyncua() -> Any:
    """The package asyncua, which says on the log what is said here in a sentence. Raises UserError where it
    is not installed.
    """
    found = need("asyncua", "opcua", "OPC UA needs")
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    return found
