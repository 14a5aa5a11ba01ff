"""Keeping up with an ageing machine: the next revision of a model, where new readings ask for one."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discovery.export.document import Exported, read_document, write_document
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.runtime.belief import AS_NEW, Belief, Finding, belief_of, residual_levels, update_belief

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey


@dataclass(frozen=True)
class Update:
    """What an update found and wrote; `path` None: nothing to change."""

    findings: tuple[Finding, ...]
    path: Path | None
    diagnosis: Mapping[str, Any] | None

    def lines(self) -> list[str]:
        """What a user wants to know of it."""
        lines = [str(finding) for finding in self.findings]
        if self.diagnosis is not None:
            named = ", ".join(
                f"{p['effect']} at {'+'.join(p['states'])}" for p in self.diagnosis.get("physics", [])
            )
            lines.append(f"the mismatch method says: {self.diagnosis['verdict']}{named and ': ' + named}")
        if self.path is None:
            lines.append(f"the model stays as it is{self._dropped()}")
        else:
            lines.append(
                f"{self.path}: the next revision; `discovery compensate` runs it in the "
                "shadow of the one at work first"
            )
        return lines

    def _dropped(self) -> str:
        """Why a drift of earlier recordings makes no revision: the last one is the machine of today."""
        drifted = [f.recording for f in self.findings if f.verdict == "drift"]
        if not drifted:
            return ""
        last = self.findings[-1]
        why = (
            "asks for a new effect, which no parameters stand in for"
            if last.verdict == "new effect"
            else "is predicted as well as when the model was fitted"
            if last.before <= AS_NEW
            else "shows none"
        )
        left = f"the drift in {', '.join(drifted)} is not taken up"
        return f": the last recording decides, and {last.recording} {why}; {left}"


def update_file(
    path: Path, campaign: Campaign, recordings: Sequence[str], out: Path, key: Ed25519PrivateKey | None = None
) -> Update:
    """`discovery update`: take in recordings one after the other and write the next revision where they ask
    for it.

    Raises:
        UserError: a model that cannot be updated, or recordings without readings.
    """
    exported = read_document(path)
    belief, levels, findings = belief_of(exported), residual_levels(exported), []
    for recording in recordings:
        belief, finding = update_belief(belief, levels, campaign, recording)
        findings.append(finding)
    strange = [f.recording for f in findings if f.verdict == "new effect"]
    diagnosis = _diagnosis(belief.at_work, campaign, strange) if strange else None
    written = None
    if findings and findings[-1].verdict == "drift":
        write_document(out, next_revision(exported, belief, findings), key)
        written = out
    return Update(tuple(findings), written, diagnosis)


def next_name(path: Path) -> Path:
    """Where the next revision of a model goes: beside it."""
    revision = read_document(path).revision + 1
    stem = path.stem.removesuffix(f".r{revision - 1}")
    return path.with_name(f"{stem}.r{revision}{path.suffix}")


def next_revision(exported: Exported, belief: Belief, findings: Sequence[Finding]) -> dict[str, Any]:
    """The document of the updated model with its changelog entry; ranges and limits stay those of the fit."""
    document = {**exported.document}
    entries = []
    for entry in document["parameters"]:
        p = belief.model.parameters[entry["name"]]
        entries.append({**entry, "value": p.value, "low": p.low, "high": p.high})
    revision = exported.revision + 1
    note = {
        "revision": revision,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "text": "; ".join(map(str, findings)),
        "of": exported.seal.sha256,
    }
    known = {**document["knowledge"], "covariance": belief.covariance.tolist()}
    return document | {
        "revision": revision,
        "parameters": entries,
        "knowledge": known,
        "changelog": [*document["changelog"], note],
    }


def _diagnosis(model: Model, campaign: Campaign, recordings: Sequence[str]) -> dict[str, Any]:
    from discovery.diagnosis import diagnose

    return dict(diagnose(model, campaign, recordings).document())
