"""IEC 61131-3 structured text of a compiled model: one function block, LREAL or REAL.

Written for what controllers are known to get wrong: loops over states are unrolled (a compiler skips `FOR j
:= 0 TO 0`), every literal is typed, both branches of a choice are computed without ever dividing by zero (a
PLC may stop there; a result that would not be finite becomes 1e30 instead, and the step fails as it does
elsewhere).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from discovery import __version__
from discovery.export.compiled import Compiled
from discovery.export.document import Exported
from discovery.export.identifiers import comment, identifier, identifiers
from discovery.export.st.language import KINDS
from discovery.export.st.step import step_text
from discovery.export.templated import templated


def st_name(exported: Exported) -> str:
    """Name of the function block of a model."""
    return "FB_" + identifier(exported.model.name)


def st_text(exported: Exported, precision: str = "double") -> str:
    """The function block and the functions it calls. `precision`: "double" (LREAL) or "float" (REAL)."""
    c, kind, name = exported.compiled, KINDS[precision], st_name(exported)
    function = f"{identifier(exported.model.name)}_{kind}"[:60]
    units = {i.name: i.unit for i in exported.inputs} | {o.name: o.unit for o in exported.outputs}
    top = "300.0" if precision == "double" else "69.0"  # of EXP, before the type overflows
    return templated(
        "block.st",
        TITLE=f"{comment(exported.model.name)}, revision {exported.revision}",
        VERSION=__version__,
        SEAL=exported.seal.sha256,
        NAME=name,
        STEP=f"{c.step_s:g}",
        FUNCTIONS=templated("functions.st", F=function, KIND=kind, TOP=top),
        INPUTS=_interface("in", c.inputs, units, kind),
        OUTPUTS=_interface("out", c.outputs, units, kind),
        VARIABLES=_declarations(c, kind),
        BODY=step_text(c, kind, function),
    )


def _interface(prefix: str, names: Sequence[str], units: Mapping[str, str], kind: str) -> str:
    """Inputs or outputs of the block, each with its name and unit as a comment."""
    return "".join(
        f"    {prefix}_{word} : {kind}; (* {comment(name)} [{comment(units[name])}] *)\n"
        for name, word in zip(names, identifiers(names), strict=True)
    )


def _declarations(c: Compiled, kind: str) -> str:
    sizes = {
        "u": len(c.inputs), "x": len(c.states), "c": len(c.states), "p": c.plays,
        "e": len(c.delays), "f": len(c.states), "a": len(c.nonzeros), "m": c.plays, "z": len(c.states),
        "xn": len(c.states), "cn": len(c.states), "y": len(c.outputs), "w": len(c.states), "term":
        len(c.states), "ring": sum(delay.length for delay in c.delays),
    }  # fmt: skip
    lines = [f"    {name} : ARRAY [0..{size}] OF {kind};\n" for name, size in sizes.items()]
    lines += [f"    position : ARRAY [0..{len(c.delays)}] OF DINT;\n", "    running : BOOL;\n"]
    lines += [f"    {name} : DINT;\n" for name in ("count", "here", "k", "j", "substeps")]
    lines += [f"    {name} : {kind};\n" for name in ("t", "norm", "sum", "tau", "part")]
    used = max(len(program.instructions) for program in (c.start, c.rates, c.results))
    return "".join(lines) + "".join(f"    v{k} : {kind};\n" for k in range(used))
