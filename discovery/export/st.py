"""IEC 61131-3 structured text of a compiled model: one function block, LREAL or REAL.

Written for what controllers are known to get wrong: loops over states are unrolled (a compiler skips `FOR j
:= 0 TO 0`), every literal is typed, both branches of a choice are computed without ever dividing by zero (a
PLC may stop there; a result that would not be finite becomes 1e30 instead, and the step fails as it does
elsewhere).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from discovery import __version__
from discovery.export.compiled import Compiled
from discovery.export.document import Exported
from discovery.export.identifiers import comment, identifier, identifiers
from discovery.export.kernel import LARGEST_NORM, LARGEST_SUBSTEPS, ORDER
from discovery.export.program import Instruction, Program
from discovery.export.statements import Language, statements

KINDS = {"double": "LREAL", "float": "REAL"}
_COMPARE = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "==": "=", "!=": "<>"}

_FUNCTIONS = """FUNCTION {f}_DIV : {k}
  VAR_INPUT a : {k}; b : {k}; END_VAR
  IF b <> {k}#0.0 THEN {f}_DIV := a / b; ELSE {f}_DIV := {k}#1.0e30; END_IF;
END_FUNCTION

FUNCTION {f}_POW : {k}
  VAR_INPUT a : {k}; b : {k}; END_VAR
  VAR n : DINT; END_VAR
  IF b = {k}#0.0 THEN {f}_POW := {k}#1.0;
  ELSIF a > {k}#0.0 THEN {f}_POW := EXPT(a, b);
  ELSIF a = {k}#0.0 THEN
    IF b > {k}#0.0 THEN {f}_POW := {k}#0.0; ELSE {f}_POW := {k}#1.0e30; END_IF;
  ELSE
    n := {k}_TO_DINT(b);
    IF DINT_TO_{k}(n) <> b THEN {f}_POW := {k}#1.0e30;
    ELSIF n MOD 2 = 0 THEN {f}_POW := EXPT({k}#0.0 - a, b);
    ELSE {f}_POW := {k}#0.0 - EXPT({k}#0.0 - a, b);
    END_IF;
  END_IF;
END_FUNCTION

FUNCTION {f}_EXP : {k}
  VAR_INPUT a : {k}; END_VAR
  IF a > {k}#{top} THEN {f}_EXP := {k}#1.0e30;
  ELSIF a < {k}#-{top} THEN {f}_EXP := {k}#0.0;
  ELSE {f}_EXP := EXP(a);
  END_IF;
END_FUNCTION

FUNCTION {f}_LOG : {k}
  VAR_INPUT a : {k}; END_VAR
  IF a > {k}#0.0 THEN {f}_LOG := LN(a); ELSE {f}_LOG := {k}#-1.0e30; END_IF;
END_FUNCTION

FUNCTION {f}_SQRT : {k}
  VAR_INPUT a : {k}; END_VAR
  IF a >= {k}#0.0 THEN {f}_SQRT := SQRT(a); ELSE {f}_SQRT := {k}#1.0e30; END_IF;
END_FUNCTION

FUNCTION {f}_TANH : {k}
  VAR_INPUT a : {k}; END_VAR
  VAR e : {k}; END_VAR
  e := {f}_EXP({k}#-2.0 * ABS(a));
  e := ({k}#1.0 - e) / ({k}#1.0 + e);
  IF a < {k}#0.0 THEN {f}_TANH := {k}#0.0 - e; ELSE {f}_TANH := e; END_IF;
END_FUNCTION
"""


def st_name(exported: Exported) -> str:
    """Name of the function block of a model."""
    return "FB_" + identifier(exported.model.name)


def literal(value: float, kind: str) -> str:
    """A typed literal.

    >>> literal(-1e-06, "LREAL")
    'LREAL#-1.0e-06'
    """
    if not math.isfinite(value):
        return f"{kind}#1.0e30"
    mantissa, mark, exponent = repr(float(value)).partition("e")
    return f"{kind}#{mantissa}{'' if '.' in mantissa else '.0'}{mark}{exponent}"


def st_text(exported: Exported, precision: str = "double") -> str:
    """The function block and the functions it calls. `precision`: "double" (LREAL) or "float" (REAL)."""
    c, kind, name = exported.compiled, KINDS[precision], st_name(exported)
    function = f"{identifier(exported.model.name)}_{kind}"[:60]
    units = {i.name: i.unit for i in exported.inputs} | {o.name: o.unit for o in exported.outputs}
    inputs = "".join(
        f"    in_{word} : {kind}; (* {comment(n)} [{comment(units[n])}] *)\n"
        for n, word in zip(c.inputs, identifiers(c.inputs), strict=True)
    )
    outputs = "".join(
        f"    out_{word} : {kind}; (* {comment(n)} [{comment(units[n])}] *)\n"
        for n, word in zip(c.outputs, identifiers(c.outputs), strict=True)
    )
    top = "300.0" if precision == "double" else "69.0"
    title = f"{comment(exported.model.name)}, revision {exported.revision}"
    return f"""(* {title}. Written by discovery {__version__}; do not edit.
   sha256 of the exported model: {exported.seal.sha256}
   Call {name} once every {c.step_s:g} s, not in every cycle of a fast task.
   Set restart for one call to begin anew.
   failed: a number was not finite; nothing has changed in that call. *)

{_FUNCTIONS.format(f=function, k=kind, top=top)}
FUNCTION_BLOCK {name}
  VAR_INPUT
    restart : BOOL;
{inputs}  END_VAR
  VAR_OUTPUT
    failed : BOOL;
{outputs}  END_VAR
  VAR
{_declarations(c, kind)}  END_VAR
{_body(c, kind, function)}
END_FUNCTION_BLOCK
"""


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


def _program(
    program: Program, results: Sequence[str], kind: str, function: str, state: str = "x", plays: str = "p"
) -> list[str]:
    loads = {
        "input": "u[{}]",
        "state": f"{state}[{{}}]",
        "delayed": "e[{}]",
        "played": f"{plays}[{{}}]",
        "time": "t",
    }
    language = Language(
        partial(literal, kind=kind),
        loads,
        partial(_expression, kind=kind, function=function),
        "{} := {};",
        "{} := {};",
    )
    return statements(program, results, language)


def _expression(instruction: Instruction, words: Sequence[str], kind: str, function: str) -> str:
    a = [words[node] for node in instruction.arguments]
    zero, one, op = f"{kind}#0.0", f"{kind}#1.0", instruction.operation
    if op in ("+", "-", "*"):
        return f"{a[0]} {op} {a[1]}"
    if op in _COMPARE:
        return f"SEL({a[0]} {_COMPARE[op]} {a[1]}, {zero}, {one})"
    if op in ("min", "max"):
        return f"SEL({a[0]} {'<' if op == 'min' else '>'} {a[1]}, {a[1]}, {a[0]})"
    if op == "select":
        return f"SEL({a[0]} <> {zero}, {a[2]}, {a[1]})"
    if op == "neg":
        return f"{zero} - {a[0]}"
    if op == "sign":
        return f"SEL({a[0]} > {zero}, SEL({a[0]} < {zero}, {zero}, {kind}#-1.0), {one})"
    if op == "abs":
        return f"ABS({a[0]})"
    call = {"/": "DIV", "**": "POW", "exp": "EXP", "log": "LOG", "sqrt": "SQRT", "tanh": "TANH"}[op]
    return f"{function}_{call}({', '.join(a)})"


def _body(c: Compiled, kind: str, function: str) -> str:
    n, outs = range(len(c.states)), range(len(c.outputs))
    zero = f"{kind}#0.0"
    ins, names = identifiers(c.inputs), identifiers(c.outputs)
    settled = [f"p[{k}]" for k in range(c.plays)]
    moved = [f"m[{k}]" for k in range(c.plays)]
    bad = f"NOT (ABS({{}}) < {kind}#1.0e30)"

    def product(source: str, target: str) -> list[str]:
        rows = [
            " + ".join(f"a[{k}] * {source}[{j}]" for k, (i, j) in enumerate(c.nonzeros) if i == row)
            for row in n
        ]
        return [f"{target}[{i}] := {row or zero};" for i, row in enumerate(rows)]

    lines = [f"u[{k}] := in_{word};" for k, word in enumerate(ins)] + [
        "failed := FALSE;",
        "IF restart OR NOT running THEN",
    ]
    first = [*(f"xn[{i}]" for i in n), *moved]
    lines += _program(c.start, first, kind, function)
    lines += [f"IF {bad.format(place)} THEN failed := TRUE; END_IF;" for place in first]
    lines += ["IF NOT failed THEN", "running := TRUE;", "count := 0;"]
    lines += [f"x[{i}] := xn[{i}]; c[{i}] := {zero};" for i in n] + [
        f"{p} := {m};" for p, m in zip(settled, moved, strict=True)
    ]
    for k, delay in enumerate(c.delays):
        lines += [
            "k := 0;",
            f"WHILE k < {delay.length} DO ring[{c.offsets[k]} + k] := u[{delay.input}]; k := k + 1; "
            f"END_WHILE;",
        ]
        lines += [f"position[{k}] := 0;"]
    lines += [
        "END_IF;",
        "END_IF;",
        "IF NOT failed THEN",
        f"t := DINT_TO_{kind}(count) * {literal(c.step_s, kind)};",
    ]
    for k, delay in enumerate(c.delays):
        length, part = delay.length, literal(delay.part, kind)
        lines += [
            f"here := (position[{k}] + 1) MOD {length};",
            f"ring[{c.offsets[k]} + here] := u[{delay.input}];",
            f"part := {kind}#1.0 - {part};",
            f"e[{k}] := part * ring[{c.offsets[k]} + (here + 2) MOD {length}] + {part} * ring[{c.offsets[k]} "
            f"+ (here + 1) MOD {length}];",
        ]
    rates = [*(f"f[{i}]" for i in n), *(f"a[{k}]" for k in range(len(c.nonzeros))), *moved]
    lines += _program(c.rates, rates, kind, function)
    lines += [f"norm := {zero};"]
    for row in n:
        total = " + ".join(f"ABS(a[{k}])" for k, (i, _) in enumerate(c.nonzeros) if i == row) or zero
        lines += [f"sum := {total};", "IF NOT (sum <= norm) THEN norm := sum; END_IF;"]
    lines += [
        f"norm := norm * {literal(c.step_s, kind)} / {literal(LARGEST_NORM, kind)};",
        f"IF NOT (norm < {literal(LARGEST_SUBSTEPS, kind)}) THEN failed := TRUE; norm := {zero}; END_IF;",
        "substeps := 1;",
        f"WHILE DINT_TO_{kind}(substeps) < norm DO substeps := substeps + 1; END_WHILE;",
        f"tau := {literal(c.step_s, kind)} / DINT_TO_{kind}(substeps);",
        *(f"z[{i}] := {zero};" for i in n),
        "k := 0;",
        "WHILE k < substeps DO",
        *product("z", "w"),
        *(f"term[{i}] := (w[{i}] + f[{i}]) * tau; z[{i}] := z[{i}] + term[{i}];" for i in n),
        "j := 2;",
        f"WHILE j <= {ORDER} DO",
        *product("term", "w"),
        f"sum := tau / DINT_TO_{kind}(j);",
        *(f"term[{i}] := w[{i}] * sum; z[{i}] := z[{i}] + term[{i}];" for i in n),
        "j := j + 1;",
        "END_WHILE;",
        "k := k + 1;",
        "END_WHILE;",
    ]
    for i in n:
        lines += [
            f"sum := z[{i}] - c[{i}];",
            f"xn[{i}] := x[{i}] + sum;",
            f"cn[{i}] := (xn[{i}] - x[{i}]) - sum;",
            f"IF {bad.format(f'xn[{i}]')} THEN failed := TRUE; END_IF;",
        ]
    lines += [f"t := DINT_TO_{kind}(count + 1) * {literal(c.step_s, kind)};"]
    lines += _program(c.results, [*(f"y[{k}]" for k in outs), *moved], kind, function, "xn", "m")
    lines += [f"IF {bad.format(f'y[{k}]')} THEN failed := TRUE; END_IF;" for k in outs]
    lines += ["IF NOT failed THEN"]
    lines += [f"x[{i}] := xn[{i}]; c[{i}] := cn[{i}];" for i in n]
    lines += [f"{p} := {m};" for p, m in zip(settled, moved, strict=True)]
    lines += [f"out_{word} := y[{k}];" for k, word in enumerate(names)]
    lines += [f"position[{k}] := (position[{k}] + 1) MOD {d.length};" for k, d in enumerate(c.delays)]
    lines += ["count := count + 1;", "END_IF;", "END_IF;"]
    return _indented(lines)


def _indented(lines: Sequence[str]) -> str:
    depth, out = 1, []
    for line in lines:
        closes = line.startswith(("END_IF", "END_WHILE"))
        depth -= closes
        out.append("  " * depth + line)
        opens = line.endswith((" THEN", " DO"))
        depth += opens
    return "\n".join(out)
