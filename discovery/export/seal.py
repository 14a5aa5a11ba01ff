"""The seal of an exported model: a hash of its bytes, and a signature (Ed25519, RFC 8032) by who answers for
it.

The seal is the last entry of the file. What is hashed and signed are the bytes before it, so that nobody has
to agree on a canonical JSON; and only those bytes are read as the model, so that nothing unsigned is ever
interpreted.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discovery.errors import UserError
from discovery.extras import need
from discovery.files import write_atomic

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

MARK = b',\n "seal": '


@dataclass(frozen=True)
class Seal:
    """SHA-256 of the sealed bytes, and by whom they are signed (hexadecimal; None: unsigned)."""

    sha256: str
    public_key: str | None
    signature: str | None


def seal_bytes(body: bytes, key: Ed25519PrivateKey | None = None) -> bytes:
    """The JSON object `body` (ending with a line "}") with its seal."""
    head = body.rstrip().removesuffix(b"}").rstrip()
    entry = {"sha256": hashlib.sha256(head).hexdigest(), "public_key": None, "signature": None}
    if key is not None:
        entry |= {"public_key": key.public_key().public_bytes_raw().hex(), "signature": key.sign(head).hex()}
    return head + MARK + json.dumps(entry).encode() + b"\n}\n"


def open_seal(data: bytes, place: str | Path) -> tuple[dict[str, Any], Seal]:
    """The document and its seal.

    Raises:
        UserError: no seal, bytes changed since, a wrong signature, or not JSON.
    """
    head, mark, tail = data.rpartition(MARK)
    if not mark:
        raise UserError(
            f"{place}: this is no sealed model; make one with `discovery export RUN --model NAME --to json`"
        )
    try:
        entry = _json(tail.rstrip().removesuffix(b"}"))
        seal = Seal(entry["sha256"], entry["public_key"], entry["signature"])
        genuine = hashlib.sha256(head).hexdigest() == seal.sha256
    except (ValueError, KeyError, TypeError):
        raise UserError(f"{place}: the seal cannot be read; export the model again") from None
    if not genuine:
        raise UserError(
            f"{place}: the file was changed after it was sealed (its SHA-256 differs); export the model again"
        )
    if seal.signature is not None and not _signed(head, seal):
        raise UserError(
            f"{place}: the signature is not that of its public key; do not use this "
            "file, export the model again"
        )
    try:
        document = _json(head + b"\n}")
    except (ValueError, RecursionError) as error:
        raise UserError(f"{place}: not valid JSON ({error}); export the model again") from None
    return document, seal


def keeping_signature(path: Path, data: bytes) -> bytes:
    """The bytes to write at `path`: `data`, or the signed file that stands there, where `data` is the same
    document without a signature.

    Raises:
        UserError: `data` is unsigned, and another document stands there that is signed.
    """
    head, _, _ = data.rpartition(MARK)
    if not path.is_file() or open_seal(data, path)[1].signature is not None:
        return data
    old = path.read_bytes()
    try:
        signed = open_seal(old, path)[1].signature is not None
    except UserError:
        _crypto()  # without it nobody knows; with it, this is no signature that anybody could trust
        return data
    if not signed:
        return data
    if old.rpartition(MARK)[0] == head:
        return old
    raise UserError(
        f"{path}: it is signed, and the model to write is another one without a signature; nothing was "
        "written; sign this one (`--sign KEY`), or write it to another place (`--out`)"
    )


def _json(data: bytes) -> dict[str, Any]:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) != len(pairs):
            raise ValueError("a key appears twice")
        return found

    def refuse(word: str) -> float:
        raise ValueError(f"{word} is not a number")

    value = json.loads(data, object_pairs_hook=unique, parse_constant=refuse)
    if not isinstance(value, dict):
        raise ValueError("not an object")
    return value


def _signed(head: bytes, seal: Seal) -> bool:
    ed25519, invalid = _crypto()
    try:
        public = ed25519.Ed25519PublicKey.from_public_bytes(bytes.fromhex(seal.public_key or ""))
        public.verify(bytes.fromhex(seal.signature or ""), head)
    except (invalid, ValueError, TypeError):
        return False
    return True


def require_trusted(seal: Seal, trusted: Ed25519PublicKey, place: str | Path) -> None:
    """Refuse a model that the owner of `trusted` has not signed.

    Raises:
        UserError: unsigned, or signed by someone else.
    """
    if seal.signature is None:
        raise UserError(
            f"{place}: the model is not signed, so it is not run; sign it with "
            "`discovery export ... --sign KEY`"
        )
    if seal.public_key != trusted.public_bytes_raw().hex():
        raise UserError(
            f"{place}: the model is signed by key {str(seal.public_key)[:16]}..., "
            "which is not the trusted one"
        )


def private_key(path: Path) -> Ed25519PrivateKey:
    """The private key of a PEM file; made, with its public half (`.pub`), when there is none yet.

    Raises:
        UserError: a file that holds no Ed25519 key.
    """
    ed25519, _ = _crypto()
    from cryptography.hazmat.primitives import serialization as form

    if not path.exists():
        key: Ed25519PrivateKey = ed25519.Ed25519PrivateKey.generate()
        path.parent.mkdir(parents=True, exist_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.NoEncryption()))
        public = key.public_key().public_bytes(form.Encoding.PEM, form.PublicFormat.SubjectPublicKeyInfo)
        write_atomic(path.with_name(path.name + ".pub"), public)
        return key
    try:
        found = form.load_pem_private_key(path.read_bytes(), password=None)
    except (ValueError, TypeError):
        found = None
    if not isinstance(found, ed25519.Ed25519PrivateKey):
        raise UserError(
            f"{path}: no Ed25519 private key without password in PEM form; name a new file to have one made"
        )
    known: Ed25519PrivateKey = found
    return known


def public_key(path: Path) -> Ed25519PublicKey:
    """The public key of a PEM file.

    Raises:
        UserError: no such file, or no Ed25519 public key in it.
    """
    ed25519, _ = _crypto()
    from cryptography.hazmat.primitives import serialization as form

    if not path.exists():
        raise UserError(
            f"{path}: there is no such key; `discovery export --sign KEY` writes it next to KEY, as KEY.pub"
        )
    try:
        found = form.load_pem_public_key(path.read_bytes())
    except ValueError:
        found = None
    if not isinstance(found, ed25519.Ed25519PublicKey):
        raise UserError(f"{path}: no Ed25519 public key in PEM form; name the .pub file of the signing key")
    known: Ed25519PublicKey = found
    return known


def _crypto() -> Any:
    need("cryptography", "export", "signatures need")
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric import ed25519

    return ed25519, InvalidSignature
