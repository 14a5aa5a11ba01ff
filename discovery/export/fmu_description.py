"""The model description of an FMI unit: its variables in the order of `templates/instance.h`, units,
structure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from discovery import __version__
from discovery.export.c import c_prefix
from discovery.export.document import Exported
from discovery.export.guarding import MEANING, compensated
from discovery.export.identifiers import comment

_BASE = {
    "degC": 'K="1" factor="1" offset="273.15"',
    "K": 'K="1"',
    "um": 'm="1" factor="1e-06"',
    "mm": 'm="1" factor="0.001"',
    "um/m": 'rad="1" factor="1e-06"',
    "W": 'kg="1" m="2" s="-3"',
    "rpm": 'rad="1" s="-1" factor="0.10471975511965977"',
    "l/min": 'm="3" s="-1" factor="1.6666666666666667e-05"',
    "kg/min": 'kg="1" s="-1" factor="0.016666666666666666"',
}


def token(exported: Exported) -> str:
    """What a simulator has to say to instantiate the unit."""
    h = exported.seal.sha256
    return f"{{{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}}}"


def start_inputs(exported: Exported) -> list[float]:
    """Inputs before any is set: the middle of the trained range."""
    return [0.5 * (i.range.low + i.range.high) for i in exported.inputs]


@dataclass(frozen=True)
class Variable:
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


def variables(exported: Exported) -> list[Variable]:
    """All variables in the order of `instance.h`."""
    errors = [exported.outputs[k] for k in compensated(exported)]
    found = [
        Variable(i.name, "Real", "input", "discrete", i.role, i.unit, repr(start))
        for i, start in zip(exported.inputs, start_inputs(exported), strict=True)
    ]
    found += [Variable(o.name, "Real", "output", "discrete", o.role, o.unit) for o in exported.outputs]
    found += [
        Variable(f"offset.{o.name}", "Real", "output", "discrete", f"offset that takes off {o.name}", o.unit)
        for o in errors
    ]
    found.append(
        Variable("runtime.gain", "Real", "output", "discrete", "1 in the trained range, less far outside")
    )
    for name, value in exported.compiled.parameters:
        p = exported.model.parameters[name]
        found.append(
            Variable(name, "Real", "parameter", "tunable", "parameter of the model", p.unit, repr(value))
        )
    for word, meaning in (("limit", "limit"), ("rate", "rate_of_offset")):
        for o in errors:
            value = o.range.limit if word == "limit" else o.range.rate
            unit = o.unit if word == "limit" else ""
            found.append(
                Variable(
                    f"{word}.{o.name}", "Real", "parameter", "tunable", MEANING[meaning], unit, repr(value)
                )
            )
    found += [
        Variable(f"good.{i.name}", "Boolean", "input", "discrete", f"{i.name} is good", start="true")
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
        found.append(Variable(f"runtime.{name}", "Boolean", causality, variability, meaning, start=start))
    found.append(Variable("runtime.status", "Integer", "output", "discrete", "status word"))
    modes = "0 OFF, 1 COLD, 2 WARM, 3 ACTIVE, 4 DEGRADED, 5 FROZEN, 6 FAULT"
    return [*found, Variable("runtime.state", "Integer", "output", "discrete", modes)]


def _units(found: Sequence[Variable]) -> str:
    lines = []
    for name in sorted({v.unit for v in found} - {""}):
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


def description2(exported: Exported) -> str:
    prefix, step, found = c_prefix(exported), exported.compiled.step_s, variables(exported)
    rows = "\n".join(
        f"    <ScalarVariable {v.attributes(k)}><{v.kind}{v.values()}/></ScalarVariable>"
        for k, v in enumerate(found)
    )
    outputs = [k + 1 for k, v in enumerate(found) if v.causality == "output"]
    unknowns = "".join(f'<Unknown index="{k}"/>' for k in outputs)
    names = "".join(f'<File name="{name}"/>' for name in (f"{prefix}.c", "fmi2.c"))
    return f"""{_XML}
<fmiModelDescription fmiVersion="2.0" guid="{token(exported)}" {_head(exported)} numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="{prefix}" canHandleVariableCommunicationStepSize="true"
                canGetAndSetFMUstate="true" canSerializeFMUstate="true">
    <SourceFiles>{names}</SourceFiles>
  </CoSimulation>
{_units(found)}  <DefaultExperiment startTime="0" stopTime="{3600 * step!r}" stepSize="{step!r}"/>
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


def description3(exported: Exported) -> str:
    prefix, step, found = c_prefix(exported), exported.compiled.step_s, variables(exported)
    time = len(found)
    rows = "\n".join(f"    <{_KINDS3[v.kind]} {v.attributes(k)}{v.values()}/>" for k, v in enumerate(found))
    outputs = [k for k, v in enumerate(found) if v.causality == "output"]
    listed = "".join(f'<Output valueReference="{r}"/>' for r in outputs)
    unknowns = "".join(f'<InitialUnknown valueReference="{r}"/>' for r in outputs)
    return f"""{_XML}
<fmiModelDescription fmiVersion="3.0" instantiationToken="{token(exported)}" {_head(exported)}>
  <CoSimulation modelIdentifier="{prefix}" canHandleVariableCommunicationStepSize="true"
                canGetAndSetFMUState="true" canSerializeFMUState="true"/>
{_units(found)}  <DefaultExperiment startTime="0" stopTime="{3600 * step!r}" stepSize="{step!r}"/>
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
