"""Opening a session at an OPC UA server: certificates checked on both sides, refusals said in a sentence."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.extras import need
from discovery.runtime.opcua_form import ConnectionForm


class UnreachableError(UserError):
    """The server does not answer (yet); what else is wrong nobody knows."""


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
            "and servers refuse this; make them equal"
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
            f"{form.url}: the certificate of the server (SHA-1 {print_of_other}) is not {named} (SHA-1 "
            f"{certificate.fingerprint(hashes.SHA1()).hex()}); if the machine has a new one, compare its "
            "fingerprint at the machine and fetch it with `discovery opcua certificate`"
        )


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
