"""FMI 2.0 and 3.0 co-simulation units of an exported model: sources, a binary for linux64 and, where the
cross compiler is installed, for win64. Inputs are guarded and offsets limited as in the runtime; parameters
can be tuned.

Inputs are declared discrete: a simulator then holds them, as the reference does, and does not interpolate.
The headers of the standard (2-clause BSD) are taken from FMPy and travel with the sources.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discovery.errors import UserError
from discovery.export.c import c_files, c_prefix
from discovery.export.document import Exported
from discovery.export.fmu_description import description2, description3, start_inputs, token, variables
from discovery.export.replay import (
    CFLAGS,
    LIMITS,
    Proof,
    Reference,
    unit_of,
    within,
    write_files,
)
from discovery.export.templated import templated
from discovery.extras import need

_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}
_BINARY = {2: "binaries/linux64", 3: "binaries/x86_64-linux"}
_WINDOWS_BINARY = {2: "binaries/win64", 3: "binaries/x86_64-windows"}
WINDOWS = "x86_64-w64-mingw32-gcc"


def fmu_bytes(exported: Exported, version: int) -> bytes:
    """The unit as a zip archive.

    Raises:
        UserError: FMPy is missing, or the sources do not compile without warnings.
    """
    headers = Path(_fmpy().__file__).parent / "c-code"
    prefix = c_prefix(exported)
    start = "".join(f"{value!r}, " for value in start_inputs(exported)).rstrip(" ")
    sources = c_files(exported) | {
        "instance.h": templated(
            "instance.h",
            prefix,
            GUID=token(exported),
            START=start,
            PARAMETERS=len(exported.compiled.parameters),
        ),
        f"fmi{version}.c": templated(f"fmi{version}.c"),
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_files(folder, dict(sources))
        library = folder / f"{prefix}.so"
        names = [f"{prefix}.c", f"fmi{version}.c"]
        binary = _compiled(version, ["gcc", "-fPIC", f"-I{headers}", *names, "-lm"], library)
        windows = None
        if shutil.which(WINDOWS) is not None:
            windows = _compiled(
                version,
                [WINDOWS, "-static-libgcc", f"-I{headers}", *names, "-lm"],
                folder / f"{prefix}.dll",
            )
    files: dict[str, str | bytes] = {f"sources/{name}": text for name, text in sources.items()}
    files |= {f"sources/{name}": (headers / name).read_bytes() for name in _HEADERS[version]}
    files["modelDescription.xml"] = description2(exported) if version == 2 else description3(exported)
    files[f"{_BINARY[version]}/{prefix}.so"] = binary
    if windows is not None:
        files[f"{_WINDOWS_BINARY[version]}/{prefix}.dll"] = windows
    if version == 3:
        listed = "".join(f'      <SourceFile name="{name}"/>\n' for name in names)
        files["sources/buildDescription.xml"] = (
            '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
            f'  <BuildConfiguration modelIdentifier="{prefix}">\n    <SourceFileSet language="C99">\n{listed}'
            "    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n"
        )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(files.items()):  # a fixed date: the same model gives the same bytes
            archive.writestr(zipfile.ZipInfo(name, (2000, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def _compiled(version: int, command: Sequence[str], library: Path) -> bytes:
    """A shared library of the sources in the same folder, without a warning."""
    whole = [command[0], *CFLAGS, "-shared", *command[1:], "-o", str(library)]
    done = subprocess.run(whole, cwd=library.parent, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UserError(
            f"the FMI {version}.0 sources do not compile without warnings ({command[0]}): "
            f"{done.stderr.strip()[-400:]}"
        )
    return library.read_bytes()


def prove_fmu(exported: Exported, reference: Reference, version: int, data: bytes) -> Proof:
    """Validate and simulate a unit through FMPy; it must give the reference, also after a state is saved and
    restored.

    Raises:
        UserError: the unit is not valid, or deviates.
    """
    fmpy = _fmpy()
    from fmpy.validation import validate_fmu

    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "model.fmu"
        path.write_bytes(data)
        problems = validate_fmu(str(path))
        if problems:
            raise UserError(f"the FMI {version}.0 unit is not valid: {problems[0]}")
        step, steps = exported.compiled.step_s, len(reference.u)
        names = exported.compiled.inputs
        switches = [v for v in variables(exported) if v.kind == "Boolean" and v.causality == "input"]
        kinds = [*((name, float) for name in names), *((v.name, bool) for v in switches)]
        signals = np.zeros(steps, dtype=[("time", float), *kinds])
        for v in switches:
            signals[v.name] = v.start == "true"
        signals["time"] = np.arange(steps) * step
        for i, name in enumerate(names):
            signals[name] = reference.u[:, i]
        result = fmpy.simulate_fmu(
            str(path),
            stop_time=steps * step,
            step_size=step,
            output_interval=step,
            input=signals if names else None,
            start_values=dict(zip(names, reference.u[0].tolist(), strict=True)) | {"runtime.guards": False},
            output=list(exported.compiled.outputs),
            fmi_type="CoSimulation",
        )
        y = np.column_stack([result[name] for name in exported.compiled.outputs])[1:]
        deviation = float(np.max(np.abs(y - reference.y))) if len(y) == steps else float("nan")
    return within(
        Proof(
            f"FMI {version}.0",
            deviation,
            LIMITS["double"],
            unit_of(exported),
            "validated and simulated with FMPy, " + _where(),
        )
    )


def _where() -> str:
    """For which systems a binary is inside."""
    if shutil.which(WINDOWS) is not None:
        return "binaries for linux64 and win64"
    return f"binary for linux64 alone: {WINDOWS} (Debian: gcc-mingw-w64-x86-64) is not installed"


def _fmpy() -> Any:
    return need("fmpy", "export", "FMI export needs")
