"""The models of a machine: the one at work, the one before it, and one that waits in the shadow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from discovery.errors import UserError
from discovery.export.document import Exported, read_document
from discovery.export.seal import require_trusted
from discovery.files import write_atomic

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

ACTIVE, PREVIOUS, CANDIDATE, REFUSED = "active.json", "previous.json", "candidate.json", "refused.json"


@dataclass(frozen=True)
class Models:
    """The model at work, and the candidate that is tried in its shadow."""

    active: Exported
    candidate: Exported | None


def open_store(
    folder: Path, model: Path, exported: Exported, trusted: Ed25519PublicKey | None = None
) -> Models:
    """The model at work in `folder`, and `model` as candidate where it is another one.

    The first model of a folder is at work at once: there is nothing yet that a shadow run could be compared
    with.

    Raises:
        UserError: the model at work is damaged, or not signed by `trusted`.
    """
    data = model.read_bytes()
    if not (folder / ACTIVE).exists():
        write_atomic(folder / ACTIVE, data)
    active = read_document(folder / ACTIVE)
    if trusted is not None:
        require_trusted(active.seal, trusted, folder / ACTIVE)
    if exported.seal.sha256 in (active.seal.sha256, *(entry.get("of") for entry in active.changelog)):
        return Models(active, _waiting(folder, trusted))  # the model at work, or one that it came from
    write_atomic(folder / CANDIDATE, data)
    return Models(active, exported)


def _waiting(folder: Path, trusted: Ed25519PublicKey | None) -> Exported | None:
    """A candidate whose shadow run was cut short by a restart."""
    if not (folder / CANDIDATE).exists():
        return None
    found = read_document(folder / CANDIDATE)
    if trusted is not None:
        require_trusted(found.seal, trusted, folder / CANDIDATE)
    return found


def offer(folder: Path, data: bytes) -> Exported:
    """A new revision as candidate."""
    write_atomic(folder / CANDIDATE, data)
    return read_document(folder / CANDIDATE)


def replace_active(folder: Path) -> None:
    """The candidate becomes the model at work; that one is kept for one step back."""
    write_atomic(folder / PREVIOUS, (folder / ACTIVE).read_bytes())
    (folder / CANDIDATE).replace(folder / ACTIVE)


def refuse_candidate(folder: Path) -> None:
    """The candidate is put aside."""
    (folder / CANDIDATE).replace(folder / REFUSED)


def step_back(folder: Path) -> Exported:
    """The model before the one at work takes over again; the other one is kept in its place.

    Raises:
        UserError: there is none before.
    """
    if not (folder / PREVIOUS).exists():
        raise UserError(f"{folder}: there is no earlier model, so --back is not possible")
    now, before = (folder / ACTIVE).read_bytes(), (folder / PREVIOUS).read_bytes()
    write_atomic(folder / ACTIVE, before)
    write_atomic(folder / PREVIOUS, now)
    return read_document(folder / ACTIVE)
