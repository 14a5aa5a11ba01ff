"""FMI 2.0 and 3.0 co-simulation units (source and linux64 binary) of an exported model.

Inputs are declared discrete: a simulator then holds them, as the reference does, and does not interpolate.
The headers of the standard (2-clause BSD) are taken from FMPy and travel with the sources.
"""

from __future__ import annotations

import io
import subprocess
import tempfile
import zipfile
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from discovery import __version__
from discovery.errors import UserError
from discovery.export.c import c_files, c_prefix
from discovery.export.document import Exported
from discovery.export.identifiers import comment
from discovery.export.replay import (
    CFLAGS,
    LIMITS,
    Proof,
    Reference,
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
_BASE = {
    "degC": 'K="1" factor="1" offset="273.15"',
    "K": 'K="1"',
    "um": 'm="1" factor="1e-06"',
    "mm": 'm="1" factor="0.001"',
    "um/m": 'rad="1" factor="1e-06"',
    "W": 'kg="1" m="2" s="-3"',
    "rpm": 'rad="1" s="-1" factor="0.10471975511965977"',
    "l/min": 'm="3" s="-1" factor="1.6666666666666667e-05"',
}


def fmu_bytes(exported: Exported, version: int) -> bytes:
    """The unit as a zip archive.

    Raises:
        UserError: FMPy is missing, or the sources do not compile without warnings.
    """
    headers = Path(_fmpy().__file__).parent / "c-code"
    prefix = c_prefix(exported)
    start = "".join(f"{value!r}, " for value in _start(exported)).rstrip(" ")
    sources = c_files(exported) | {
        "instance.h": templated("instance.h", prefix, GUID=_token(exported), START=start),
        f"fmi{version}.c": templated(f"fmi{version}.c"),
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_files(folder, dict(sources))
        library = folder / f"{prefix}.so"
        names = [f"{prefix}.c", f"fmi{version}.c"]
        command = ["gcc", *CFLAGS, "-fPIC", "-shared", f"-I{headers}", *names, "-lm", "-o", str(library)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise UserError(
                f"the FMI {version}.0 sources do not compile without warnings: {done.stderr.strip()[-400:]}"
            )
        binary = library.read_bytes()
    files: dict[str, str | bytes] = {f"sources/{name}": text for name, text in sources.items()}
    files |= {f"sources/{name}": (headers / name).read_bytes() for name in _HEADERS[version]}
    files["modelDescription.xml"] = _description2(exported) if version == 2 else _description3(exported)
    files[f"{_BINARY[version]}/{prefix}.so"] = binary
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
        signals = np.zeros(steps, dtype=[("time", float), *((name, float) for name in names)])
        signals["time"] = np.arange(steps) * step
        for i, name in enumerate(names):
            signals[name] = reference.u[:, i]
        result = fmpy.simulate_fmu(
            str(path),
            stop_time=steps * step,
            step_size=step,
            output_interval=step,
            input=signals if names else None,
            start_values=dict(zip(names, reference.u[0].tolist(), strict=True)),
            output=list(exported.compiled.outputs),
            fmi_type="CoSimulation",
        )
        y = np.column_stack([result[name] for name in exported.compiled.outputs])[1:]
        deviation = float(np.max(np.abs(y - reference.y))) if len(y) == steps else float("nan")
    return within(Proof(f"FMI {version}.0", deviation, LIMITS["double"], "validated and simulated with FMPy"))


def _token(exported: Exported) -> str:
    h = exported.seal.sha256
    return f"{{{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}}}"


def _start(exported: Exported) -> list[float]:
    """Inputs before any is set: the middle of the trained range."""
    return [0.5 * (i.range.low + i.range.high) for i in exported.inputs]


def _units(exported: Exported) -> str:
    names = sorted({i.unit for i in exported.inputs} | {o.unit for o in exported.outputs})
    lines = []
    for name in names:
        base = f"<BaseUnit {_BASE[name]}/>" if name in _BASE else ""
        lines.append(
            f"    <Unit name={quoteattr(name)}>{base}</Unit>"
            if base
            else f"    <Unit name={quoteattr(name)}/>"
        )
    return "  <UnitDefinitions>\n" + "\n".join(lines) + "\n  </UnitDefinitions>\n"


def _head(exported: Exported) -> str:
    text = f"{comment(exported.model.name)}, revision {exported.revision}, sha256 {exported.seal.sha256}"
    name, tool = quoteattr(comment(exported.model.name)), quoteattr(f"discovery {__version__}")
    return f"modelName={name} description={quoteattr(text)} generationTool={tool}"


def _variables(exported: Exported) -> list[tuple[str, str, str]]:
    """Name and shared attributes, unit, and start of each variable; its place is its value reference."""
    found = []
    for k, (i, start) in enumerate(zip(exported.inputs, _start(exported), strict=True)):
        shared = (
            f'valueReference="{k}" causality="input" variability="discrete" description={quoteattr(i.role)}'
        )
        found.append(
            (f"name={quoteattr(i.name)} {shared}", f"unit={quoteattr(i.unit)}", f' start="{start!r}"')
        )
    for k, o in enumerate(exported.outputs, start=len(exported.inputs)):
        shared = f'valueReference="{k}" causality="output" variability="discrete" initial="calculated"'
        shared += f" description={quoteattr(o.role)}"
        found.append((f"name={quoteattr(o.name)} {shared}", f"unit={quoteattr(o.unit)}", ""))
    return found


_XML = '<?xml version="1.0" encoding="UTF-8"?>'


def _description2(exported: Exported) -> str:
    prefix, n, step = c_prefix(exported), len(exported.inputs), exported.compiled.step_s
    rows = "\n".join(
        f"    <ScalarVariable {attributes}><Real {unit}{start}/></ScalarVariable>"
        for attributes, unit, start in _variables(exported)
    )
    unknowns = "".join(f'<Unknown index="{n + k + 1}"/>' for k in range(len(exported.outputs)))
    names = "".join(f'<File name="{name}"/>' for name in (f"{prefix}.c", "fmi2.c"))
    return f"""{_XML}
<fmiModelDescription fmiVersion="2.0" guid="{_token(exported)}" {_head(exported)} numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="{prefix}" canHandleVariableCommunicationStepSize="true"
                canGetAndSetFMUstate="true" canSerializeFMUstate="true">
    <SourceFiles>{names}</SourceFiles>
  </CoSimulation>
{_units(exported)}  <DefaultExperiment startTime="0" stopTime="{3600 * step!r}" stepSize="{step!r}"/>
  <ModelVariables>
{rows}
  </ModelVariables>
  <ModelStructure>
    <Outputs>{unknowns}</Outputs>
    <InitialUnknowns>{unknowns}</InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def _description3(exported: Exported) -> str:
    prefix, n, step = c_prefix(exported), len(exported.inputs), exported.compiled.step_s
    time = n + len(exported.outputs)
    rows = "\n".join(
        f"    <Float64 {attributes} {unit}{start}/>" for attributes, unit, start in _variables(exported)
    )
    outputs = "".join(f'<Output valueReference="{r}"/>' for r in range(n, time))
    unknowns = "".join(f'<InitialUnknown valueReference="{r}"/>' for r in range(n, time))
    return f"""{_XML}
<fmiModelDescription fmiVersion="3.0" instantiationToken="{_token(exported)}" {_head(exported)}>
  <CoSimulation modelIdentifier="{prefix}" canHandleVariableCommunicationStepSize="true"
                canGetAndSetFMUState="true" canSerializeFMUState="true"/>
{_units(exported)}  <DefaultExperiment startTime="0" stopTime="{3600 * step!r}" stepSize="{step!r}"/>
  <ModelVariables>
    <Float64 name="time" valueReference="{time}" causality="independent" variability="continuous"/>
{rows}
  </ModelVariables>
  <ModelStructure>
    {outputs}
    {unknowns}
  </ModelStructure>
</fmiModelDescription>
"""


def _fmpy() -> Any:
    return need("fmpy", "export", "FMI export needs")
