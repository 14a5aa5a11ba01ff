"""C99 of a compiled model: one header, one source file; double, or float with -DDISCOVERY_FLOAT.

No malloc, no recursion, no libraries but the mathematics of the standard; every array has a fixed size. What
a controller calls is `<name>_begin` once and `<name>_tick` each step (guarded inputs, limited offsets), or
`<name>_start` and `<name>_step` (the model alone).
"""

from __future__ import annotations

from collections.abc import Sequence

from discovery import __version__
from discovery.export.c_guard import guard_source, real, settings
from discovery.export.compiled import Compiled, Delay
from discovery.export.document import Exported
from discovery.export.guarding import compensated, without_offsets
from discovery.export.identifiers import comment, formula, identifier, identifiers
from discovery.export.kernel import LARGEST_NORM, LARGEST_SUBSTEPS, ORDER
from discovery.export.program import Instruction, Program
from discovery.export.statements import Language, statements
from discovery.export.templated import templated
from discovery.terms import names

_CALL = {"exp": "R_EXP", "log": "R_LOG", "sqrt": "R_SQRT", "tanh": "R_TANH", "abs": "R_ABS", "**": "R_POW"}
_COMPARE = ("<", "<=", ">", ">=", "==", "!=")


# Other files in the folder of a model, in C or in an FMU, and headers that they include: no model may
# have these names.
_TAKEN = frozenset(
    {"replay", "instance", "fmi2", "fmi3", "math", "stdbool", "stddef", "stdint", "stdio", "stdlib"}
    | {"string", "time", *(f"fmi{v}{part}" for v in (2, 3) for part in ("functions", "functiontypes"))}
    | {"fmi2typesplatform", "fmi3platformtypes"}
)


_KEYWORDS = frozenset(
    (
        "auto", "break", "case", "char", "const", "continue", "default", "do", "double",
        "else", "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long",
        "register", "restrict", "return", "short", "signed", "sizeof", "static", "struct",
        "switch", "typedef", "union", "unsigned", "void", "volatile", "while", "real",
    )
)  # fmt: skip


def c_prefix(exported: Exported) -> str:
    """Beginning of every name in the C files of a model, and name of its files."""
    word = identifier(exported.model.name).lower()
    return f"{word}_model" if word in _TAKEN else word


def _expression(instruction: Instruction, words: Sequence[str]) -> str:
    a = [words[node] for node in instruction.arguments]
    op = instruction.operation
    if op in ("+", "-", "*", "/"):
        return f"{a[0]} {op} {a[1]}"
    if op in _COMPARE:
        return f"({a[0]} {op} {a[1]}) ? R(1.0) : R(0.0)"
    if op in ("min", "max"):
        return f"({a[0]} {'<' if op == 'min' else '>'} {a[1]}) ? {a[0]} : {a[1]}"
    if op == "select":
        return f"({a[0]} != R(0.0)) ? {a[1]} : {a[2]}"
    if op == "neg":
        return f"-{a[0]}"
    if op == "sign":
        return f"({a[0]} > R(0.0)) ? R(1.0) : (({a[0]} < R(0.0)) ? R(-1.0) : R(0.0))"
    if op == "exp":
        return f"R_EXP(({a[0]} < R(500.0)) ? {a[0]} : R(500.0))"
    return f"{_CALL[op]}({', '.join(a)})"


def parameter_words(c: Compiled) -> list[str]:
    """Names of the parameters as C has them."""
    return [f"{w}_" if w in _KEYWORDS else w for w in identifiers([name for name, _ in c.parameters])]


def _language(c: Compiled) -> Language:
    words = parameter_words(c)
    return Language(
        real,
        {
            "input": "u[{}]",
            "parameter": [f"k->{word}" for word in words],
            "state": "x[{}]",
            "delayed": "d[{}]",
            "played": "p[{}]",
            "time": "t",
        },
        _expression,
        "    const real {} = {};",
        "    {} = {};",
        "    /* {} */",
    )


def c_files(exported: Exported) -> dict[str, str]:
    """Header and source by file name."""
    prefix = c_prefix(exported)
    return {
        f"{prefix}.h": _header(exported, prefix),
        f"{prefix}.c": _source(exported, prefix),
    }


def _title(exported: Exported) -> str:
    return (
        f"/* {comment(exported.model.name)}, revision {exported.revision}. Written by discovery "
        f"{__version__}; do not edit.\n"
        f" * sha256 of the exported model: {exported.seal.sha256}\n"
        + "".join(f" * {comment(said)}.\n" for said in without_offsets(exported.outputs))
    )


def _sizes(exported: Exported) -> dict[str, int]:
    c = exported.compiled
    return {
        "OFFSETS": len(compensated(exported)),
        "INPUTS": len(c.inputs),
        "OUTPUTS": len(c.outputs),
        "STATES": len(c.states),
        "DELAYS": len(c.delays),
        "PLAYS": c.plays,
        "RING": sum(delay.length for delay in c.delays),
    }


def _parameter_lines(exported: Exported, line: str) -> str:
    """A line for each parameter: its word, its value, what it is."""
    model, rows = exported.model, []
    for word, (name, value) in zip(
        parameter_words(exported.compiled), exported.compiled.parameters, strict=True
    ):
        used = [term.name for term in model.terms if name in names(term.expression)]
        used += [output for output, expression in model.outputs.items() if name in names(expression)]
        said = f"{name} [{model.parameters[name].unit}]: {', '.join(used) or 'not used'}"
        rows.append(line.format(word=word, value=real(value), note=formula(said)))
    return "\n".join(rows) or line.format(word="none", value=real(0.0), note="this model has no parameters")


def _header(exported: Exported, prefix: str) -> str:
    c, up = exported.compiled, prefix.upper()
    units = {i.name: i.unit for i in exported.inputs} | {o.name: o.unit for o in exported.outputs}
    places = [
        f"enum {prefix}_{kind} {{\n"
        + ",\n".join(
            f"    {up}_{short}_{word} = {k} /* {comment(name)} [{comment(units[name])}] */"
            for k, (name, word) in enumerate(zip(group, identifiers(group), strict=True))
        )
        + "\n};"
        for kind, short, group in (("input", "IN", c.inputs), ("output", "OUT", c.outputs))
        if group
    ]
    errors = [exported.outputs[k].name for k in compensated(exported)]
    offsets = ",\n".join(
        f"    {up}_OFFSET_{word} = {k} /* {comment(name)} [{comment(units[name])}] */"
        for k, (name, word) in enumerate(zip(errors, identifiers(errors), strict=True))
    )
    return templated(
        "model.h",
        prefix,
        TITLE=_title(exported),
        STEP=f"{c.step_s:g}",
        SIZES="\n".join(f"#define {up}_{name} {size}" for name, size in _sizes(exported).items()),
        STEP_S=repr(c.step_s),
        PLACES="\n".join(places),
        FIXED=", except durations of delays" if c.delays else "",
        PARAMETERS=_parameter_lines(exported, f"    {prefix}_real {{word}}; /* {{note}} */"),
        SETTINGS=settings(exported, prefix)[0],
        OFFSET_PLACES=f"enum {prefix}_offset {{\n{offsets}\n}};" if errors else "",
    )


def _function(
    c: Compiled, kind: str, program: Program, results: Sequence[str], outputs: str, prefix: str
) -> str:
    given = f"const {prefix}_parameters *k, const real x[], const real u[], const real d[], "
    given += "const real p[], real t"
    words = [word.split()[-1].removesuffix("[]").lstrip("*") for word in f"{given}, {outputs}".split(", ")]
    body = "\n".join(statements(program, results, _language(c)))
    return f"""static void {kind}({given}, {outputs})
{{
{body}
    {" ".join(f"(void){name};" for name in words)}
}}
"""


def _source(exported: Exported, prefix: str) -> str:
    c = exported.compiled
    n = len(c.states)
    plays = [f"moved[{k}]" for k in range(c.plays)]
    first = [f"first[{i}]" for i in range(n)]
    rates = [f"f[{i}]" for i in range(n)] + [f"a[{k}]" for k in range(len(c.nonzeros))]
    read = [f"y[{k}]" for k in range(len(c.outputs))]
    sums = "    sum = {};\n    if (sum > norm) {{ norm = sum; }}"
    return templated(
        "model.c",
        prefix,
        TITLE=_title(exported),
        DEFAULTS=_parameter_lines(exported, "    {value}, /* {note} */"),
        STATES=n,
        NONZEROS=len(c.nonzeros),
        STEP=real(c.step_s),
        START_VALUES=_function(
            c, "start_values", c.start, first + plays, "real first[], real moved[]", prefix
        ),
        RATES=_function(c, "rates", c.rates, rates + plays, "real f[], real a[], real moved[]", prefix),
        OUTPUTS=_function(c, "outputs", c.results, read + plays, "real y[], real moved[]", prefix),
        PRODUCT="\n".join(f"    w[{i}] = {row};" for i, row in enumerate(_rows(c, "a[{k}] * v[{j}]"))),
        SUMS="\n".join(sums.format(row) for row in _rows(c, "R_ABS(a[{k}])")),
        LARGEST_NORM=real(LARGEST_NORM),
        LARGEST_SUBSTEPS=real(LARGEST_SUBSTEPS),
        ORDER=ORDER,
        COUNTER="    uint32_t k;\n" if c.delays else "",
        FIRST="\n".join(map(_first, range(len(c.delays)), c.delays, c.offsets)),
        HERE="    uint32_t here;\n" if c.delays else "",
        DELAYED="\n".join(map(_delayed, range(len(c.delays)), c.delays, c.offsets)),
        MOVED_ON="\n".join(map(_moved_on, range(len(c.delays)), c.delays)),
        GUARD=guard_source(exported, prefix),
    )


def _rows(c: Compiled, word: str) -> list[str]:
    """Sum over the nonzeros of each row of the Jacobian."""
    return [
        " + ".join(word.format(k=k, j=j) for k, (i, j) in enumerate(c.nonzeros) if i == row) or "R(0.0)"
        for row in range(len(c.states))
    ]


def _first(k: int, delay: Delay, offset: int) -> str:
    """A delayed input at the start: it never changed before."""
    return f"""    for (k = {offset}; k < {offset + delay.length}u; ++k) {{ s->ring[k] = u[{delay.input}]; }}
    s->position[{k}] = 0; s->d[{k}] = u[{delay.input}];"""


def _delayed(k: int, delay: Delay, offset: int) -> str:
    return f"""    here = (s->position[{k}] + 1u) % {delay.length}u;
    s->ring[{offset}u + here] = u[{delay.input}];
    d[{k}] = (R(1.0) - {real(delay.part)}) * s->ring[{offset}u + (here + 2u) % {delay.length}u]
           + {real(delay.part)} * s->ring[{offset}u + (here + 1u) % {delay.length}u];"""


def _moved_on(k: int, delay: Delay) -> str:
    return f"    s->position[{k}] = (s->position[{k}] + 1u) % {delay.length}u;\n    s->d[{k}] = d[{k}];"
