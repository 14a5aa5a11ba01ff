"""The proof that structured text gives the reference."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.identifiers import identifiers
from discovery.export.replay import LIMITS, Proof, Reference, within
from discovery.export.st.block import st_name, st_text
from discovery.export.st.language import KINDS
from discovery.export.st.reader import read_structured_text

STEPS = 360  # of the reference that are read step by step


def prove_st(exported: Exported, reference: Reference) -> list[Proof]:
    """Replay the text in both precisions with the workbench's own reader; compile it where iec2c (matiec) is
    installed.

    Raises:
        UserError: a deviation above the limit, or a compiler that refuses the text.
    """
    proofs = []
    for precision, kind in KINDS.items():
        text = st_text(exported, precision)
        note = f"read by discovery, first {min(STEPS, len(reference.u))} steps; {_compiled(text)}"
        proofs.append(
            within(
                Proof(
                    f"structured text {kind}",
                    _replay(exported, reference, text, kind),
                    LIMITS[precision],
                    note,
                )
            )
        )
    return proofs


def _replay(exported: Exported, reference: Reference, text: str, kind: str) -> float:
    block = read_structured_text(text)[st_name(exported)]
    scope = block.scope() | {"guards": False, "limits": False}  # the model alone
    number = np.float32 if kind == "REAL" else float
    ins = [f"in_{word}" for word in identifiers(exported.compiled.inputs)]
    outs = [f"out_{word}" for word in identifiers(exported.compiled.outputs)]
    worst = 0.0
    for u, y in zip(reference.u[:STEPS], reference.y[:STEPS], strict=True):
        scope.update({name: number(value) for name, value in zip(ins, u, strict=True)})
        block.run(scope)
        if scope["failed"]:
            return float("inf")
        worst = max(worst, *(abs(float(scope[name]) - value) for name, value in zip(outs, y, strict=True)))
    return worst


def _compiled(text: str) -> str:
    compiler = shutil.which("iec2c")
    if compiler is None:
        return "not compiled: no structured text compiler (iec2c of matiec) is installed"
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "model.st").write_text(text)
        done = subprocess.run(
            [compiler, "-T", name, "model.st"], cwd=name, capture_output=True, text=True, check=False
        )
    if done.returncode:
        raise UserError(f"iec2c refuses the structured text: {(done.stderr or done.stdout).strip()[-400:]}")
    return "compiled with iec2c"
