"""Replay: reference inputs and outputs that travel with every target, and the proof that a target gives them.

The reference outputs are those of `Stepper`.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.c import c_files, c_prefix
from discovery.export.compiled import Compiled
from discovery.export.document import Exported
from discovery.export.stepper import free_run
from discovery.export.templated import templated
from discovery.models.units import differences

Array = NDArray[np.float64]

LIMITS = {"double": 1e-9, "float": 1e-3}  # in the unit of each output
LONGEST = 8640  # steps of a reference: a day at 10 s
CFLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O2")


@dataclass(frozen=True)
class Reference:
    """Inputs u (K, U) of each step and outputs y (K, Y) at its end."""

    u: Array
    y: Array


@dataclass(frozen=True)
class Proof:
    """What a replay found: largest deviation from the Python model in the unit of the outputs (of any of them
    where they have several); None: not run, and why.
    """

    target: str
    deviation: float | None
    limit: float
    unit: str
    note: str = ""

    def __str__(self) -> str:
        if self.deviation is None:
            return f"{self.target}: not run, {self.note}"
        note = f", {self.note}" if self.note else ""
        far = measured(self.deviation, self.unit)
        return f"{self.target}: {far} from the Python model (limit {self.limit:g}){note}"


def measured(deviation: float, unit: str) -> str:
    """A deviation with its unit.

    >>> measured(0.012, "K"), measured(3e-9, "1")
    ('0.012 K', '3e-09')
    """
    return f"{deviation:.2g}{'' if unit == '1' else f' {unit}'}"


def unit_of(exported: Exported) -> str:
    """The units in which outputs can deviate, as a sentence names them: "um or um/m", "K"."""
    return " or ".join(dict.fromkeys(differences(output.unit) for output in exported.outputs))


def make_reference(compiled: Compiled, inputs: Array) -> Reference:
    """Reference of a model for inputs (K, U), of which at most a day is kept.

    Raises:
        UserError: a step that is not finite.
    """
    inputs = np.ascontiguousarray(inputs[:LONGEST])
    y = free_run(compiled, inputs)
    if len(y) < len(inputs):
        raise UserError(
            f"model '{compiled.name}' is not finite after {len(y)} steps of its reference inputs; "
            "check it or shorten the step"
        )
    return Reference(inputs, y)


def reference_files(compiled: Compiled, reference: Reference) -> dict[str, str]:
    """The reference as two CSV files, every number with all its digits."""

    def table(names: Sequence[str], rows: Array) -> str:
        return ",".join(names) + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()) + "\n"

    return {
        "reference_inputs.csv": table(compiled.inputs, reference.u),
        "reference_outputs.csv": table(compiled.outputs, reference.y),
    }


def prove_c(exported: Exported, reference: Reference) -> list[Proof]:
    """Compile the C files as the user will, double and float, and replay them.

    Raises:
        UserError: warnings, or a deviation above the limit.
    """
    proofs = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_files(
            folder,
            {**c_files(exported), **replay_source(exported), **reference_files(exported.compiled, reference)},
        )
        for kind, flags in (("double", []), ("float", ["-DDISCOVERY_FLOAT"])):
            source = ["replay.c", f"{c_prefix(exported)}.c"]
            command = ["gcc", *CFLAGS, *flags, *source, "-lm", "-o", "replay"]
            _call(command, folder, "the C code does not compile without warnings")
            done = _call(
                ["./replay", "reference_inputs.csv", "reference_outputs.csv"],
                folder,
                f"the C code in {kind} cannot be replayed",
                (0, 1),
            )
            proofs.append(
                within(Proof(f"C {kind}", float(done.split()[-1]), LIMITS[kind], unit_of(exported)))
            )
    return proofs


def replay_source(exported: Exported) -> dict[str, str]:
    """The C program that replays the reference."""
    return {"replay.c": templated("replay.c", c_prefix(exported))}


def within(proof: Proof) -> Proof:
    """The proof, where it holds.

    Raises:
        UserError: a deviation above the limit.
    """
    if proof.deviation is not None and not proof.deviation <= proof.limit:
        raise UserError(
            f"{proof.target} deviates by {measured(proof.deviation, proof.unit)} from the Python model, more "
            f"than {proof.limit:g}; nothing was exported: "
            "simplify the model (very large or very stiff terms) or use another target"
        )
    return proof


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Write files by name into a folder, each whole or not at all."""
    from discovery.files import write_atomic

    for name, content in files.items():
        write_atomic(folder / name, content)


def _call(command: Sequence[str], folder: Path, problem: str, allowed: tuple[int, ...] = (0,)) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode not in allowed:
        raise UserError(f"{problem}: {(done.stderr or done.stdout).strip()[-400:]}")
    return done.stdout
