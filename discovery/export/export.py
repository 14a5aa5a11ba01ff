"""A fitted model as a document and as code, each proved equal to the Python model before it is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UsageError, UserError
from discovery.export.agreement import agreement
from discovery.export.c import c_files
from discovery.export.document import Exported, from_document, read_document, render
from discovery.export.fmu import fmu_bytes, prove_fmu
from discovery.export.identifiers import identifier
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.replay import (
    LONGEST,
    Proof,
    Reference,
    make_reference,
    measured,
    prove_c,
    reference_files,
    replay_source,
    write_files,
)
from discovery.export.seal import keeping_signature, open_seal
from discovery.export.settling import beginning
from discovery.export.st import KINDS, plcopen_text, prove_st, scl_text, st_name, st_text
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.runfolder import read_results
from discovery.schema import suggest
from discovery.targets import check_targets

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Export:
    """What an export wrote, and the proofs that it is the model."""

    files: tuple[Path, ...]
    proofs: tuple[Proof, ...]
    agreement: Mapping[str, Mapping[str, float]] | None  # of the fixed step with discovery.dynamics
    start: tuple[str, ...]  # what to know before the compensation starts

    def lines(self) -> list[str]:
        """What a user wants to know of it."""
        lines = [*(str(path) for path in self.files), *(str(proof) for proof in self.proofs)]
        if self.agreement is not None:
            same, held = (
                " and ".join(measured(value, unit) for unit, value in self.agreement[kind].items())
                for kind in ("integrator", "held_inputs")
            )
            lines.append(
                f"the fixed step is {same} from the fitted model under the same inputs, {held} where inputs "
                "are held over a step"
            )
        return [*lines, *self.start]


def export_model(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    to: str | Sequence[str],
    out_dir: Path,
    *,
    step_s: float = 10.0,
    states: int | None = None,
    key: Ed25519PrivateKey | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> Export:
    """Export a fitted model; the JSON document, master of all targets, is always written.

    Args:
        recordings: those of the fit; ranges, limits and the reference of the replay come from them alone.
        to: targets, some of `discovery.targets.TARGETS`.
        out_dir: folder that the files go to.
        step_s: fixed internal step [s].
        states: reduce the model to so many states first (see `discovery.export.reduce`).
        key: signs the document. Without one, a signed document in `out_dir` that says the same is kept.
        provenance: what else should be known about where the model comes from.

    Raises:
        UsageError: an unknown target, or an impossible step.
        UserError: a model that cannot be exported, a target that is not equal, or another document in
            `out_dir` that is signed, without a key for this one; then nothing is written.
    """
    targets = (to,) if isinstance(to, str) else tuple(to)
    check_targets(targets)
    if not 0.001 <= step_s <= 3600.0:
        raise UsageError(
            f"a step of {step_s:g} s is not possible; give one between 0.001 and 3600, usually 1 to 10"
        )
    if not recordings:
        raise UserError(
            f"model '{model.name}': name at least one recording of the fit; ranges and reference come from it"
        )
    notes = dict(provenance or {})
    if states is not None:
        from discovery.export.reduce import reduce_model

        reduction = reduce_model(model, campaign, recordings, states, step_s)
        model = reduction.model
        notes["reduction"] = reduction.note()
    found = agreement(model, campaign, recordings[0], step_s)
    document = make_document(model, campaign, recordings, step_s, {**notes, "agreement_with_dynamics": found})
    data = keeping_signature(out_dir / _file_of(model), render(document, key))
    body, seal = open_seal(data, model.name)
    exported = from_document(body, seal, model.name)
    inputs = sampled_inputs(campaign, recordings[0], exported.compiled.inputs, step_s)
    reference = make_reference(exported.compiled, inputs)
    files, proofs = _files(exported, data, reference, targets)
    write_files(out_dir, files)
    return Export(tuple(out_dir / name for name in files), proofs, found, tuple(beginning(exported)))


def _file_of(model: Model) -> str:
    """The name of the document of a model in its folder."""
    return f"{identifier(model.name)}.json"


def _files(
    exported: Exported, data: bytes, reference: Reference, targets: Sequence[str]
) -> tuple[dict[str, str | bytes], tuple[Proof, ...]]:
    """Files of a document and its targets by name, and the proofs that the targets agree with the model."""
    stem = identifier(exported.model.name)
    files: dict[str, str | bytes] = {_file_of(exported.model): data}
    proofs: list[Proof] = []
    for target in dict.fromkeys(targets):
        made, proved = _TARGETS[target](exported, reference, stem)
        files |= made
        proofs += proved
    return files, tuple(proofs)


Made = tuple[dict[str, str | bytes], list[Proof]]


def _json(exported: Exported, reference: Reference, stem: str) -> Made:  # noqa: ARG001
    return dict(reference_files(exported.compiled, reference)), []


def _c(exported: Exported, reference: Reference, stem: str) -> Made:  # noqa: ARG001
    texts = {**c_files(exported), **replay_source(exported), **reference_files(exported.compiled, reference)}
    return {f"c/{name}": text for name, text in texts.items()}, prove_c(exported, reference)


def _fmu(version: int, suffix: str, exported: Exported, reference: Reference, stem: str) -> Made:
    data = fmu_bytes(exported, version)
    files: dict[str, str | bytes] = {f"{stem}{suffix}.fmu": data}
    files |= reference_files(exported.compiled, reference)
    return files, [prove_fmu(exported, reference, version, data)]


def _st(exported: Exported, reference: Reference, stem: str) -> Made:  # noqa: ARG001
    proofs = prove_st(exported, reference)
    texts = {
        f"{st_name(exported)}_{kind}.st": st_text(exported, precision) for precision, kind in KINDS.items()
    }
    return {
        f"st/{name}": text
        for name, text in {**texts, **reference_files(exported.compiled, reference)}.items()
    }, proofs


def _plcopen(exported: Exported, reference: Reference, stem: str) -> Made:  # noqa: ARG001
    texts = {
        f"st/{st_name(exported)}_{kind}.xml": plcopen_text(exported, precision)
        for precision, kind in KINDS.items()
    }
    return dict(texts), prove_st(exported, reference)


def _scl(exported: Exported, reference: Reference, stem: str) -> Made:  # noqa: ARG001
    texts = {
        f"st/{st_name(exported)}_{kind}.scl": scl_text(exported, precision)
        for precision, kind in KINDS.items()
    }
    return dict(texts), prove_st(exported, reference, scl_text)


_TARGETS = {
    "json": _json,
    "c": _c,
    "fmu": lambda *a: _fmu(2, "", *a),
    "fmu3": lambda *a: _fmu(3, "_fmi3", *a),
    "st": _st,
    "plcopen": _plcopen,
    "scl": _scl,
}


def export_run(
    run: Path,
    name: str,
    to: str | Sequence[str],
    out_dir: Path | None = None,
    *,
    campaign: Path | None = None,
    step_s: float = 10.0,
    states: int | None = None,
    key: Ed25519PrivateKey | None = None,
) -> Export:
    """Export a model of a finished run (`discovery export`).

    Args:
        run: folder that `discovery run` wrote.
        name: of a model in its `models` folder.
        campaign: campaign file; default the one that the run names.

    Raises:
        UserError: no such run, model or campaign.
    """
    from discovery.models.modelfile import read_model
    from discovery.recordings import load_campaign

    results = read_results(run)
    model_file = run / "models" / f"{name}.toml"
    if not model_file.is_file():
        known = sorted(path.stem for path in (run / "models").glob("*.toml"))
        raise UserError(f"{run}: no model '{name}'; {suggest(name, known)}")
    seen = (*results["fit"], *results["models"].get(name, {}).get("recordings", {}))
    fit = [str(recording) for recording in dict.fromkeys(seen) if recording not in results["held_out"]]
    place = campaign or _campaign_of(run, results)
    loaded = load_campaign(place, only=fit)
    model = read_model(model_file)
    out_dir = out_dir or run / "export" / name
    provenance = {"experiment": str(results["experiment"]), "model_file": model_file.name}
    return export_model(
        model, loaded, fit, to, out_dir, step_s=step_s, states=states, key=key, provenance=provenance
    )


def export_document(
    path: Path, to: str | Sequence[str], out_dir: Path | None = None, *, key: Ed25519PrivateKey | None = None
) -> Export:
    """Export a model that is a document already, a revision for example, to further targets.

    Its recordings are not at hand: the reference inputs run through its trained ranges.

    Args:
        out_dir: default a folder next to the document, with its name.
        key: signs the document anew; without one it is copied unchanged, with its signature.

    Raises:
        UsageError: an unknown target.
        UserError: a document that cannot be read, a target that is not equal, or another document in
            `out_dir` that is signed where this one is not; then nothing is written.
    """
    targets = (to,) if isinstance(to, str) else tuple(to)
    check_targets(targets)
    exported = read_document(path)
    out_dir = out_dir or path.with_suffix("")
    data = render(exported.document, key) if key is not None else path.read_bytes()
    data = keeping_signature(out_dir / _file_of(exported.model), data)
    reference = make_reference(exported.compiled, _through_the_ranges(exported))
    files, proofs = _files(exported, data, reference, targets)
    write_files(out_dir, files)
    return Export(tuple(out_dir / name for name in files), proofs, None, tuple(beginning(exported)))


def _through_the_ranges(exported: Exported, hours: float = 12.0) -> Array:
    """Inputs (K, U) within the trained ranges, the same every time: held ones switch, temperatures wander."""
    rng = np.random.default_rng(2026)
    steps = max(60, min(LONGEST, int(hours * 3600.0 / exported.compiled.step_s)))
    columns = []
    for spec in exported.inputs:
        low, high = spec.range.low, spec.range.high
        if spec.between == "held":
            levels = rng.choice([0.0, 0.25, 0.5, 1.0], steps // 60 + 1)
            share = np.repeat(levels, 60)[:steps]
            share = np.ceil(share) if spec.role == "fluid flow" else share
        else:
            turns = rng.uniform(1.0, 4.0)
            share = 0.5 + 0.45 * np.sin(2 * np.pi * turns * np.arange(steps) / steps + rng.uniform(0.0, 6.0))
        columns.append(low + share * (high - low))
    return np.column_stack(columns) if columns else np.zeros((steps, 0))


def _campaign_of(run: Path, results: Mapping[str, Any]) -> Path:
    named = results.get("campaign_file")
    if named is None:
        raise UserError(f"{run / 'results.json'}: names no campaign file; give it with --campaign FILE")
    if Path(str(named)).exists():
        return Path(str(named))
    raise UserError(
        f"{run / 'results.json'}: the campaign {named} is not there any more; give it with --campaign FILE"
    )
