"""A later export never takes the signature from a model."""

from __future__ import annotations

from pathlib import Path

import pytest

from discovery.errors import UserError
from discovery.export import export_document, export_model
from discovery.export.document import read_document, write_document
from discovery.export.seal import private_key
from discovery.models import Model, State
from discovery.recordings import Campaign
from discovery.terms import Term, parse

BODY = State("a", "degC", 1e4, parse("T_env"), 0.5, 1e-4)
AIR = Term("air", "a", parse("2*(T_env - a) + 0.1*P_drive"))
MODEL = Model("small", {}, {"a": BODY}, (AIR,), {"E_Z0T": parse("2*(a - 22)")})


@pytest.fixture
def signed(campaign: Campaign, tmp_path: Path) -> Path:
    """The signed document of a model, and its reference, in a folder."""
    export_model(MODEL, campaign, ["fit"], "json", tmp_path / "out", key=private_key(tmp_path / "key.pem"))
    return tmp_path / "out" / "small.json"


def test_a_further_target_keeps_the_signature(campaign: Campaign, signed: Path) -> None:
    before = signed.read_bytes()
    export_model(MODEL, campaign, ["fit"], "st", signed.parent)
    assert signed.read_bytes() == before
    assert (signed.parent / "st").is_dir()


def test_another_document_does_not_replace_a_signed_one(campaign: Campaign, signed: Path) -> None:
    before = {path: path.read_bytes() for path in signed.parent.rglob("*") if path.is_file()}
    with pytest.raises(UserError, match=r"small.json: it is signed, and the model to write is another one"):
        export_model(MODEL, campaign, ["fit"], ["json", "st"], signed.parent, step_s=5.0)
    other = signed.parent.with_name("small.json")
    write_document(other, {**read_document(signed).document, "revision": 2})
    with pytest.raises(UserError, match=r"nothing was written; sign this one \(`--sign KEY`\)"):
        export_document(other, "st", signed.parent)
    with pytest.raises(UserError, match="it is signed"):  # a revision that `update` writes
        write_document(signed, {**read_document(signed).document, "revision": 2})
    assert {path: path.read_bytes() for path in signed.parent.rglob("*") if path.is_file()} == before


def test_a_key_signs_another_document(campaign: Campaign, signed: Path) -> None:
    key = private_key(signed.parent.with_name("key.pem"))
    export_model(MODEL, campaign, ["fit"], "json", signed.parent, step_s=5.0, key=key)
    again = read_document(signed)
    assert again.compiled.step_s == 5.0
    assert again.seal.public_key == key.public_key().public_bytes_raw().hex()


def test_a_file_without_a_true_signature_is_replaced(campaign: Campaign, signed: Path) -> None:
    signed.write_bytes(signed.read_bytes().replace(b"T_env", b"P_env"))
    export_model(MODEL, campaign, ["fit"], "json", signed.parent)
    assert read_document(signed).seal.signature is None
