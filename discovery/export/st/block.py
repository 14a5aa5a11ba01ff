"""IEC 61131-3 structured text of a compiled model: one function block, LREAL or REAL.

Written for what controllers are known to get wrong: loops over states are unrolled (a compiler skips `FOR j
:= 0 TO 0`), every literal is typed, both branches of a choice are computed without ever dividing by zero (a
PLC may stop there; a result that would not be finite becomes 1e30 instead, and the step fails as it does
elsewhere).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from discovery import __version__
from discovery.export.document import Exported
from discovery.export.guarding import (
    CONSTANTS,
    MEANING,
    compensated,
    without_offsets,
)
from discovery.export.identifiers import comment, formula, identifier, identifiers
from discovery.export.st.guards import settable
from discovery.export.st.language import KINDS, literal
from discovery.export.st.step import step_text
from discovery.export.templated import templated
from discovery.terms import names as names_in


def st_name(exported: Exported) -> str:
    """Name of the function block of a model."""
    return "FB_" + identifier(exported.model.name)


def st_text(exported: Exported, precision: str = "double") -> str:
    """The function block and what it calls. `precision`: "double" (LREAL) or "float" (REAL)."""
    c, kind, name = exported.compiled, KINDS[precision], st_name(exported)
    function = f"{identifier(exported.model.name)}_{kind}"[:60]
    units = {i.name: i.unit for i in exported.inputs} | {o.name: o.unit for o in exported.outputs}
    errors = [exported.outputs[k].name for k in compensated(exported)]
    top = "300.0" if precision == "double" else "69.0"  # of EXP, before the type overflows
    ok = "".join(f"    ok_{word} : BOOL := TRUE;\n" for word in identifiers(c.inputs))
    return templated(
        "block.st",
        TITLE=f"{comment(exported.model.name)}, revision {exported.revision}",
        VERSION=__version__,
        OFFSETS=comment(
            "; ".join(without_offsets(exported.outputs) or ["Add offset_... to the position of the axis"])
        ),
        SEAL=exported.seal.sha256,
        NAME=name,
        KIND=kind,
        STEP=f"{c.step_s:g}",
        FUNCTIONS=templated("functions.st", F=function, KIND=kind, TOP=top),
        GUARD=_guard(name, kind),
        INPUTS=_interface("in", c.inputs, units, kind) + ok,
        OUTPUTS=_interface("out", c.outputs, units, kind) + _interface("offset", errors, units, kind),
        PARAMETERS=_parameters(exported, kind),
        VARIABLES=_declarations(exported, kind),
        BODY=step_text(exported, kind, function),
    )


def _guard(name: str, kind: str) -> str:
    words = {word: literal(value, kind) for word, value in CONSTANTS.items()}
    return templated("guard.st", NAME=name, KIND=kind, **words)


def _interface(prefix: str, names: Sequence[str], units: Mapping[str, str], kind: str) -> str:
    """Inputs or outputs of the block, each with its name and unit as a comment."""
    return "".join(
        f"    {prefix}_{word} : {kind}; (* {comment(name)} [{comment(units[name])}] *)\n"
        for name, word in zip(names, identifiers(names), strict=True)
    )


def _parameters(exported: Exported, kind: str) -> str:
    """The parameter block: each with its number for `set_parameter`, its unit, and the terms that use it."""
    model = exported.model
    lines = []
    for k, (word, name, _) in enumerate(settable(exported), start=1):
        if name in model.parameters and word.startswith("par_"):
            used = [term.name for term in model.terms if name in names_in(term.expression)]
            used += [o for o, expression in model.outputs.items() if name in names_in(expression)]
            said = f"{name} [{model.parameters[name].unit}]: {', '.join(used) or 'not used'}"
        else:
            said = f"{name}: {MEANING['limit' if word.startswith('limit_') else 'rate_of_offset']}"
        lines.append(f"    {word} : {kind}; (* {k}: {formula(said)} *)\n")
    return "".join(lines)


def _declarations(exported: Exported, kind: str) -> str:
    c = exported.compiled
    sizes = {
        "u": len(c.inputs), "x": len(c.states), "c": len(c.states), "p": c.plays,
        "e": len(c.delays), "f": len(c.states), "a": len(c.nonzeros), "m": c.plays, "z": len(c.states),
        "xn": len(c.states), "cn": len(c.states), "y": len(c.outputs), "w": len(c.states), "term":
        len(c.states), "ring": sum(delay.length for delay in c.delays),
    }  # fmt: skip
    lines = [f"    guard_{word} : {st_name(exported)}_GUARD;\n" for word in identifiers(c.inputs)]
    lines += [f"    {name} : ARRAY [0..{size}] OF {kind};\n" for name, size in sizes.items()]
    lines += [f"    together : ARRAY [0..{len(c.inputs)}] OF BOOL;\n"]
    lines += [f"    position : ARRAY [0..{len(c.delays)}] OF DINT;\n"]
    flags = ("running", "configured", "ticked", "known", "replaced", "recovered", "has_y")
    bits = [f"bit_{k}" for k in (8, 9, 10, 11, 12, 13, 18, 19)]
    lines += [f"    {name} : BOOL;\n" for name in (*flags, *bits)]
    lines += [
        f"    {name} : DINT;\n" for name in ("count", "here", "k", "j", "substeps", "settling", "settled")
    ]
    numbers = (
        "t",
        "norm",
        "sum",
        "tau",
        "part",
        "dt",
        "good_s",
        "fail_s",
        "started_s",
        "oldest_held",
        "target",
    )
    lines += [f"    {name} : {kind};\n" for name in numbers]
    used = max(len(program.instructions) for program in (c.start, c.rates, c.results))
    return "".join(lines) + "".join(f"    v{k} : {kind};\n" for k in range(used))
