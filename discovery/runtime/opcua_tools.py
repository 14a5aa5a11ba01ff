"""Commissioning a connection: certificates, and what nodes a server has."""

from __future__ import annotations

import contextlib
import datetime
import os
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.extras import need
from discovery.files import write_atomic
from discovery.runtime.opcua_connect import connected, need_asyncua, server_certificates
from discovery.runtime.opcua_form import CLIENT_URI, ConnectionForm

VALID_DAYS = 3650
_SKIPPED = {"i=2253"}  # the server's own diagnostics


def make_certificate(folder: Path, name: str, uri: str = CLIENT_URI) -> tuple[Path, Path]:
    """Self-signed certificate (`name`.der) and private key (`name`.pem, readable by its owner alone).

    Raises:
        UserError: one of them is there already.
    """
    need("cryptography", "opcua", "certificates need")
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import rsa
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

    certificate, key_file = folder / f"{name}.der", folder / f"{name}.pem"
    for path in (certificate, key_file):
        if path.exists():
            raise UserError(f"{path}: this file exists; remove it, or give another --name")
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    host, now = socket.gethostname(), datetime.datetime.now(datetime.UTC)
    usages = [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=VALID_DAYS))
        .add_extension(
            x509.SubjectAlternativeName([x509.UniformResourceIdentifier(uri), x509.DNSName(host)]), False
        )
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), True)
        .add_extension(
            x509.KeyUsage(True, True, True, True, False, True, False, False, False), True
        )  # signature, non-repudiation, key and data encipherment, certificate signing of itself
        .add_extension(x509.ExtendedKeyUsage(usages), False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), False)
        .sign(key, hashes.SHA256())
    )
    form = serialization
    write_atomic(certificate, made.public_bytes(form.Encoding.DER))
    secret = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.NoEncryption())
    key_file.parent.mkdir(parents=True, exist_ok=True)
    with os.fdopen(os.open(key_file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(secret)
    return certificate, key_file


async def fetch_certificate(url: str, path: Path) -> str:
    """The certificate that a server shows, into a file; its SHA-1 fingerprint, which the machine shows as
    well.

    Raises:
        UserError: no server answers, or it shows none.
    """
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.x509 import load_der_x509_certificate

    shown = await server_certificates(url)
    if not shown:
        raise UserError(f"{url}: the server shows no certificate")
    certificate = load_der_x509_certificate(shown[0])
    write_atomic(path, certificate.public_bytes(serialization.Encoding.DER))
    return certificate.fingerprint(hashes.SHA1()).hex()


async def browse(form: ConnectionForm, folder: Path, start: str, depth: int) -> AsyncIterator[str]:
    """Lines on the variables below a node: node id, type, rights, value, way.

    Raises:
        UserError: see `connected`; an unknown node.
    """
    ua = need_asyncua().ua
    client = await connected(form, folder)
    try:
        async for line in _below(client, ua, client.get_node(start), "", depth, set()):
            yield line
    finally:
        with contextlib.suppress(Exception):
            await client.disconnect()


async def _below(client: Any, ua: Any, node: Any, way: str, depth: int, done: set[str]) -> AsyncIterator[str]:
    try:
        children = await node.get_references(ua.ObjectIds.HierarchicalReferences, ua.BrowseDirection.Forward)
    except Exception:
        raise UserError(
            f"there is no node {node.nodeid.to_string()} that can be browsed; start with i=85, the "
            f"Objects folder"
        ) from None
    for child in children:
        word = child.NodeId.to_string()
        if word in done or word in _SKIPPED:
            continue
        done.add(word)
        name = f"{way}/{child.BrowseName.Name}"
        inner = client.get_node(child.NodeId)
        if child.NodeClass == ua.NodeClass.Variable:
            yield await _said(ua, inner, word, name)
        if depth > 1 and child.NodeClass in (ua.NodeClass.Object, ua.NodeClass.Variable):
            async for line in _below(client, ua, inner, name, depth - 1, done):
                yield line


async def _said(ua: Any, node: Any, word: str, name: str) -> str:
    kind, rights, value = "?", "", "unreadable"
    with contextlib.suppress(Exception):
        kind = ua.VariantType((await node.read_data_type_as_variant_type()).value).name
        levels = await node.get_user_access_level()
        rights = "read, write" if ua.AccessLevel.CurrentWrite in levels else "read"
        value = repr(await node.read_value())[:40]
    return f"{word:40} {kind:10} {rights:12} {value:42} {name}"
