"""The proof that structured text gives the reference."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.identifiers import identifiers
from discovery.export.replay import LIMITS, Proof, Reference, unit_of, within
from discovery.export.st.block import st_name, st_text
from discovery.export.st.language import KINDS
from discovery.export.st.reader import read_structured_text

Spelling = Callable[[Exported, str], str]
STEPS = 360  # of the reference that are read step by step


def prove_st(exported: Exported, reference: Reference, spelling: Spelling = st_text) -> list[Proof]:
    """Replay the text in both precisions with the workbench's own reader; compile it where iec2c (matiec) or
    strucpp (STruC++) is installed.

    Args:
        spelling: plain structured text or SCL.

    Raises:
        UserError: a deviation above the limit, or a compiler that refuses the text.
    """
    proofs = []
    for precision, kind in KINDS.items():
        text = spelling(exported, precision)
        made = compiled(text) if spelling is st_text else "not compiled: only TIA Portal does"
        note = f"read by discovery, first {min(STEPS, len(reference.u))} steps; {made}"
        name = "structured text" if spelling is st_text else "SCL"
        deviation = _replay(exported, reference, text, kind)
        proofs.append(within(Proof(f"{name} {kind}", deviation, LIMITS[precision], unit_of(exported), note)))
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


# Compiler and its arguments for a file model.st in the present folder
COMPILERS = {"iec2c": ["-T", ".", "model.st"], "strucpp": ["model.st", "-o", "model.cpp"]}


def compiled(text: str) -> str:
    """Which compilers took a structured text, in words; not compiled where none is installed.

    Raises:
        UserError: a compiler that refuses the text.
    """
    found = [name for name in COMPILERS if shutil.which(name) is not None]
    for compiler in found:
        with tempfile.TemporaryDirectory() as name:
            (Path(name) / "model.st").write_text(text)
            done = subprocess.run(
                [compiler, *COMPILERS[compiler]], cwd=name, capture_output=True, text=True, check=False
            )
        if done.returncode:
            said = (done.stderr or done.stdout).strip()[-400:]
            raise UserError(f"{compiler} refuses the structured text: {said}")
    if found:
        return f"compiled with {' and '.join(found)}"
    return "not compiled: no structured text compiler (iec2c of matiec, strucpp) is installed"
