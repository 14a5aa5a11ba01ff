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
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from discovery import __version__
from discovery.errors import UserError
from discovery.export.c import c_files, c_prefix
from discovery.export.document import Exported
from discovery.export.guarding import MEANING, compensated
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
_WINDOWS_BINARY = {2: "binaries/win64", 3: "binaries/x86_64-windows"}
WINDOWS = "x86_64-w64-mingw32-gcc"
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
        "instance.h": templated(
            "instance.h",
            prefix,
            GUID=_token(exported),
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
    files["modelDescription.xml"] = _description2(exported) if version == 2 else _description3(exported)
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
    """A shared library of the sources beside it, without a warning."""
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
        switches = [v for v in _variables(exported) if v.kind == "Boolean" and v.causality == "input"]
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
            f"FMI {version}.0", deviation, LIMITS["double"], "validated and simulated with FMPy, " + _where()
        )
    )


def _where() -> str:
    """For which systems a binary is inside."""
    if shutil.which(WINDOWS) is not None:
        return "binaries for linux64 and win64"
    return f"binary for linux64 alone: {WINDOWS} (Debian: gcc-mingw-w64-x86-64) is not installed"


def _token(exported: Exported) -> str:
    h = exported.seal.sha256
    return f"{{{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}}}"


def _start(exported: Exported) -> list[float]:
    """Inputs before any is set: the middle of the trained range."""
    return [0.5 * (i.range.low + i.range.high) for i in exported.inputs]


@dataclass(frozen=True)
class _Variable:
    """A variable of the unit; its place in the list is its value reference."""

    name: str
    kind: str  # Real, Boolean, Integer
    causality: str
    variability: str
    description: str
    unit: str = ""
    start: str = ""

    def attributes(self, reference: int) -> str:
        initial = ' initial="calculated"' if self.causality == "output" else ""
        return (
            f'name={quoteattr(self.name)} valueReference="{reference}" causality="{self.causality}" '
            f'variability="{self.variability}"{initial} description={quoteattr(self.description)}'
        )

    def values(self) -> str:
        unit = f" unit={quoteattr(self.unit)}" if self.unit else ""
        return f'{unit} start="{self.start}"' if self.start else unit


def _variables(exported: Exported) -> list[_Variable]:
    """All variables in the order of `instance.h`."""
    errors = [exported.outputs[k] for k in compensated(exported)]
    found = [
        _Variable(i.name, "Real", "input", "discrete", i.role, i.unit, repr(start))
        for i, start in zip(exported.inputs, _start(exported), strict=True)
    ]
    found += [_Variable(o.name, "Real", "output", "discrete", o.role, o.unit) for o in exported.outputs]
    found += [
        _Variable(f"offset.{o.name}", "Real", "output", "discrete", f"offset that takes off {o.name}", o.unit)
        for o in errors
    ]
    found.append(
        _Variable("runtime.gain", "Real", "output", "discrete", "1 in the trained range, less far outside")
    )
    for name, value in exported.compiled.parameters:
        p = exported.model.parameters[name]
        found.append(
            _Variable(name, "Real", "parameter", "tunable", "parameter of the model", p.unit, repr(value))
        )
    for word, meaning in (("limit", "limit"), ("rate", "rate_of_offset")):
        for o in errors:
            value = o.range.limit if word == "limit" else o.range.rate
            unit = o.unit if word == "limit" else ""
            found.append(
                _Variable(
                    f"{word}.{o.name}", "Real", "parameter", "tunable", MEANING[meaning], unit, repr(value)
                )
            )
    found += [
        _Variable(f"good.{i.name}", "Boolean", "input", "discrete", f"{i.name} is good", start="true")
        for i in exported.inputs
    ]
    for name, causality, start, meaning in (
        ("enable", "input", "true", "false: offsets go to zero"),
        ("part_done", "input", "false", "offsets that are held after a failure may be let go"),
        ("acknowledge", "input", "false", "an operator has looked: steps that wait are accepted"),
        ("guards", "parameter", "true", "bad inputs are replaced by their last good value"),
        ("limits", "parameter", "true", "offsets are limited in size and rate"),
        ("fade", "parameter", "true", "the gain falls far outside of the training"),
    ):
        variability = "discrete" if causality == "input" else "tunable"
        found.append(_Variable(f"runtime.{name}", "Boolean", causality, variability, meaning, start=start))
    found.append(_Variable("runtime.status", "Integer", "output", "discrete", "status word"))
    modes = "0 OFF, 1 COLD, 2 WARM, 3 ACTIVE, 4 DEGRADED, 5 FROZEN, 6 FAULT"
    return [*found, _Variable("runtime.state", "Integer", "output", "discrete", modes)]


def _units(variables: Sequence[_Variable]) -> str:
    lines = []
    for name in sorted({v.unit for v in variables} - {""}):
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


_XML = '<?xml version="1.0" encoding="UTF-8"?>'


def _description2(exported: Exported) -> str:
    prefix, step, variables = c_prefix(exported), exported.compiled.step_s, _variables(exported)
    rows = "\n".join(
        f"    <ScalarVariable {v.attributes(k)}><{v.kind}{v.values()}/></ScalarVariable>"
        for k, v in enumerate(variables)
    )
    outputs = [k + 1 for k, v in enumerate(variables) if v.causality == "output"]
    unknowns = "".join(f'<Unknown index="{k}"/>' for k in outputs)
    names = "".join(f'<File name="{name}"/>' for name in (f"{prefix}.c", "fmi2.c"))
    return f"""{_XML}
<fmiModelDescription fmiVersion="2.0" guid="{_token(exported)}" {_head(exported)} numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="{prefix}" canHandleVariableCommunicationStepSize="true"
                canGetAndSetFMUstate="true" canSerializeFMUstate="true">
    <SourceFiles>{names}</SourceFiles>
  </CoSimulation>
{_units(variables)}  <DefaultExperiment startTime="0" stopTime="{3600 * step!r}" stepSize="{step!r}"/>
  <ModelVariables>
{rows}
  </ModelVariables>
  <ModelStructure>
    <Outputs>{unknowns}</Outputs>
    <InitialUnknowns>{unknowns}</InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


_KINDS3 = {"Real": "Float64", "Boolean": "Boolean", "Integer": "Int32"}


def _description3(exported: Exported) -> str:
    prefix, step, variables = c_prefix(exported), exported.compiled.step_s, _variables(exported)
    time = len(variables)
    rows = "\n".join(
        f"    <{_KINDS3[v.kind]} {v.attributes(k)}{v.values()}/>" for k, v in enumerate(variables)
    )
    outputs = [k for k, v in enumerate(variables) if v.causality == "output"]
    listed = "".join(f'<Output valueReference="{r}"/>' for r in outputs)
    unknowns = "".join(f'<InitialUnknown valueReference="{r}"/>' for r in outputs)
    return f"""{_XML}
<fmiModelDescription fmiVersion="3.0" instantiationToken="{_token(exported)}" {_head(exported)}>
  <CoSimulation modelIdentifier="{prefix}" canHandleVariableCommunicationStepSize="true"
                canGetAndSetFMUState="true" canSerializeFMUState="true"/>
{_units(variables)}  <DefaultExperiment startTime="0" stopTime="{3600 * step!r}" stepSize="{step!r}"/>
  <ModelVariables>
    <Float64 name="time" valueReference="{time}" causality="independent" variability="continuous"/>
{rows}
  </ModelVariables>
  <ModelStructure>
    {listed}
    {unknowns}
  </ModelStructure>
</fmiModelDescription>
"""


def _fmpy() -> Any:
    return need("fmpy", "export", "FMI export needs")
