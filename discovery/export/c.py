"""C99 of a compiled model: one header, one source file; double, or float with -DDISCOVERY_FLOAT.

No malloc, no recursion, no libraries but the mathematics of the standard; every array has a fixed size. What
a controller calls is `<name>_start` once and `<name>_step` each step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from discovery import __version__
from discovery.export.compiled import Compiled
from discovery.export.document import Exported
from discovery.export.identifiers import comment, identifier, identifiers
from discovery.export.kernel import LARGEST_NORM, LARGEST_SUBSTEPS, ORDER
from discovery.export.program import Instruction, Program

_LOAD = {"input": "u[{}]", "state": "x[{}]", "delayed": "d[{}]", "played": "p[{}]", "time": "t"}
_CALL = {"exp": "R_EXP", "log": "R_LOG", "sqrt": "R_SQRT", "tanh": "R_TANH", "abs": "R_ABS", "**": "R_POW"}
_COMPARE = ("<", "<=", ">", ">=", "==", "!=")


def c_prefix(exported: Exported) -> str:
    """Beginning of every name in the C files of a model."""
    return identifier(exported.model.name).lower()


def real(value: float) -> str:
    """A number as the macro R() takes it.

    >>> real(0.1), real(-3.0)
    ('R(0.1)', 'R(-3.0)')
    """
    if math.isnan(value):
        return "(R(0.0)/R(0.0))"
    if math.isinf(value):
        return "R_HUGE" if value > 0 else "(-R_HUGE)"
    return f"R({float(value)!r})"


def body(program: Program, results: Sequence[str]) -> str:
    """Statements that compute a program and store its results in the places named."""
    words: list[str] = []
    lines: list[str] = []
    for k, instruction in enumerate(program.instructions):
        if instruction.operation == "constant":
            words.append(real(instruction.value))
        elif instruction.operation in _LOAD:
            words.append(_LOAD[instruction.operation].format(instruction.index))
        else:
            words.append(f"v{k}")
            lines.append(f"    const real v{k} = {_expression(instruction, words)};")
    lines += [f"    {place} = {words[node]};" for place, node in zip(results, program.results, strict=True)]
    return "\n".join(lines)


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


def c_files(exported: Exported) -> dict[str, str]:
    """Header and source by file name."""
    prefix = c_prefix(exported)
    return {
        f"{prefix}.h": _header(exported, prefix),
        f"{prefix}.c": _source(exported.compiled, prefix, _title(exported)),
    }


def _title(exported: Exported) -> str:
    return (
        f"/* {comment(exported.model.name)}, revision {exported.revision}. Written by discovery "
        f"{__version__}; do not edit.\n"
        f" * sha256 of the exported model: {exported.seal.sha256}\n"
    )


def _sizes(c: Compiled) -> dict[str, int]:
    return {
        "INPUTS": len(c.inputs),
        "OUTPUTS": len(c.outputs),
        "STATES": len(c.states),
        "DELAYS": len(c.delays),
        "PLAYS": c.plays,
        "RING": sum(delay.whole + 2 for delay in c.delays),
    }


def _header(exported: Exported, prefix: str) -> str:
    c, up = exported.compiled, prefix.upper()
    sizes = "\n".join(f"#define {up}_{name} {size}" for name, size in _sizes(c).items())
    units = {i.name: i.unit for i in exported.inputs} | {o.name: o.unit for o in exported.outputs}
    entries = [
        f"enum {prefix}_{kind} {{\n"
        + ",\n".join(
            f"    {up}_{short}_{word} = {k} /* {comment(name)} [{comment(units[name])}] */"
            for k, (name, word) in enumerate(zip(group, identifiers(group), strict=True))
        )
        + "\n};"
        for kind, short, group in (("input", "IN", c.inputs), ("output", "OUT", c.outputs))
        if group
    ]
    return f"""{_title(exported)} *
 * {prefix}_start once with the first inputs, then {prefix}_step every {c.step_s:g} s.
 * Compile with -DDISCOVERY_FLOAT for float; never with -ffast-math, which would undo the compensated sums.
 */
#ifndef {up}_H
#define {up}_H

#include <stdint.h>

#ifdef DISCOVERY_FLOAT
typedef float {prefix}_real;
#else
typedef double {prefix}_real;
#endif

{sizes}
#define {up}_STEP_S {c.step_s!r}

{chr(10).join(entries)}

typedef struct {{
    {prefix}_real x[{up}_STATES + 1];        /* states */
    {prefix}_real c[{up}_STATES + 1];        /* what rounding left over of their sums */
    {prefix}_real d[{up}_DELAYS + 1];        /* delayed inputs */
    {prefix}_real p[{up}_PLAYS + 1];         /* plays */
    {prefix}_real ring[{up}_RING + 1];       /* past inputs */
    uint32_t position[{up}_DELAYS + 1];
    uint32_t count;                    /* steps since the start */
}} {prefix}_state;

/* Both return 0 when done, 1 where a number is not finite; then nothing has changed. */
int {prefix}_start({prefix}_state *s, const {prefix}_real u[]);
int {prefix}_step({prefix}_state *s, const {prefix}_real u[], {prefix}_real y[]);

/* Outputs of the present state under inputs u, without a step. */
void {prefix}_outputs(const {prefix}_state *s, const {prefix}_real u[], {prefix}_real y[]);

#endif
"""


_MATHS = """typedef {prefix}_real real;

#ifdef DISCOVERY_FLOAT
#define R(number) number##f
#define R_POW powf
#define R_EXP expf
#define R_LOG logf
#define R_SQRT sqrtf
#define R_TANH tanhf
#define R_ABS fabsf
#define R_HUGE HUGE_VALF
#else
#define R(number) number
#define R_POW pow
#define R_EXP exp
#define R_LOG log
#define R_SQRT sqrt
#define R_TANH tanh
#define R_ABS fabs
#define R_HUGE HUGE_VAL
#endif
"""


def _function(kind: str, program: Program, results: Sequence[str], outputs: str) -> str:
    given = "const real x[], const real u[], const real d[], const real p[], real t"
    names = [word.split()[-1].removesuffix("[]") for word in f"{given}, {outputs}".split(", ")]
    return f"""static void {kind}({given}, {outputs})
{{
{body(program, results)}
    {" ".join(f"(void){name};" for name in names)}
}}
"""


def _source(c: Compiled, prefix: str, title: str) -> str:
    up, n = prefix.upper(), len(c.states)
    plays = [f"moved[{k}]" for k in range(c.plays)]
    rates = [f"f[{i}]" for i in range(n)] + [f"a[{k}]" for k in range(len(c.nonzeros))] + plays
    rows = [
        " + ".join(f"a[{k}] * v[{j}]" for k, (i, j) in enumerate(c.nonzeros) if i == row) or "R(0.0)"
        for row in range(n)
    ]
    norms = [
        " + ".join(f"R_ABS(a[{k}])" for k, (i, _) in enumerate(c.nonzeros) if i == row) or "R(0.0)"
        for row in range(n)
    ]
    read = [f"y[{k}]" for k in range(len(c.outputs))] + plays
    start = [f"first[{i}]" for i in range(n)] + [f"moved[{k}]" for k in range(c.plays)]
    product = "\n".join(f"    w[{i}] = {row};" for i, row in enumerate(rows))
    sums = "\n".join(f"    sum = {row};\n    if (sum > norm) {{ norm = sum; }}" for row in norms)
    offsets = [sum(d.whole + 2 for d in c.delays[:k]) for k in range(len(c.delays))]

    def delayed(k: int) -> str:
        delay, offset = c.delays[k], offsets[k]
        length = delay.whole + 2
        return f"""    here = (s->position[{k}] + 1u) % {length}u;
    s->ring[{offset}u + here] = u[{delay.input}];
    d[{k}] = (R(1.0) - {real(delay.part)}) * s->ring[{offset}u + (here + 2u) % {length}u]
           + {real(delay.part)} * s->ring[{offset}u + (here + 1u) % {length}u];"""

    def moved_on(k: int) -> str:
        length = c.delays[k].whole + 2
        return f"    s->position[{k}] = (s->position[{k}] + 1u) % {length}u;\n    s->d[{k}] = d[{k}];"

    def first(k: int) -> str:
        delay, offset = c.delays[k], offsets[k]
        last = offset + delay.whole + 2
        return f"""    for (k = {offset}; k < {last}u; ++k) {{ s->ring[k] = u[{delay.input}]; }}
    s->position[{k}] = 0; s->d[{k}] = u[{delay.input}];"""

    here = "    uint32_t here;\n" if c.delays else ""
    counter = "    uint32_t k;\n" if c.delays else ""
    newline = "\n"
    return f"""{title} */
#include "{prefix}.h"

#include <math.h>

{_MATHS.format(prefix=prefix)}
#define N {n}
#define A {len(c.nonzeros)}
#define H {real(c.step_s)}

{_function("start_values", c.start, start, "real first[], real moved[]")}
{_function("rates", c.rates, rates, "real f[], real a[], real moved[]")}
{_function("outputs", c.results, read, "real y[], real moved[]")}
/* w = A v */
static void product(const real a[], const real v[], real w[])
{{
{product}
    (void)a; (void)v; (void)w;
}}

/* z = h phi1(h A) f; 1 where A is too stiff or not finite */
static int increment(const real a[], const real f[], real z[])
{{
    real norm = R(0.0);
    real sum = R(0.0);
    real v[N + 1];
    real w[N + 1];
    real tau;
    int substeps = 1;
    int i, j, k;
{sums}
    norm = norm * H / {real(LARGEST_NORM)};
    if (!(norm < {real(LARGEST_SUBSTEPS)})) {{ return 1; }}
    while ((real)substeps < norm) {{ ++substeps; }}
    tau = H / (real)substeps;
    for (i = 0; i < N; ++i) {{ z[i] = R(0.0); }}
    for (k = 0; k < substeps; ++k) {{
        product(a, z, v);
        for (i = 0; i < N; ++i) {{ v[i] = (v[i] + f[i]) * tau; z[i] += v[i]; }}
        for (j = 2; j <= {ORDER}; ++j) {{
            product(a, v, w);
            for (i = 0; i < N; ++i) {{ v[i] = w[i] * (tau / (real)j); z[i] += v[i]; }}
        }}
    }}
    (void)a; (void)f; (void)sum;
    return 0;
}}

int {prefix}_start({prefix}_state *s, const real u[])
{{
    real x[N + 1];
    real moved[{up}_PLAYS + 1];
    int i;
{counter}    start_values(s->x, u, s->d, s->p, R(0.0), x, moved);
    for (i = 0; i < N; ++i) {{ if (!(R_ABS(x[i]) < R(1e30))) {{ return 1; }} }}
    for (i = 0; i < {up}_PLAYS; ++i) {{ if (!(R_ABS(moved[i]) < R(1e30))) {{ return 1; }} }}
    for (i = 0; i < N; ++i) {{ s->x[i] = x[i]; s->c[i] = R(0.0); }}
    for (i = 0; i < {up}_PLAYS; ++i) {{ s->p[i] = moved[i]; }}
{newline.join(first(k) for k in range(len(c.delays)))}
    s->count = 0;
    return 0;
}}

void {prefix}_outputs(const {prefix}_state *s, const real u[], real y[])
{{
    real moved[{up}_PLAYS + 1];
    outputs(s->x, u, s->d, s->p, (real)s->count * H, y, moved);
}}

int {prefix}_step({prefix}_state *s, const real u[], real y[])
{{
    real d[{up}_DELAYS + 1];
    real f[N + 1];
    real a[A + 1];
    real moved[{up}_PLAYS + 1];
    real settled[{up}_PLAYS + 1];
    real z[N + 1];
    real x[N + 1];
    real c[N + 1];
    real out[{up}_OUTPUTS + 1];
    int i;
{here}{newline.join(delayed(k) for k in range(len(c.delays)))}
    rates(s->x, u, d, s->p, (real)s->count * H, f, a, moved);
    if (increment(a, f, z) != 0) {{ return 1; }}
    for (i = 0; i < N; ++i) {{
        const real step = z[i] - s->c[i];
        x[i] = s->x[i] + step;
        c[i] = (x[i] - s->x[i]) - step;
        if (!(R_ABS(x[i]) < R(1e30))) {{ return 1; }}
    }}
    outputs(x, u, d, moved, (real)(s->count + 1u) * H, out, settled);
    for (i = 0; i < {up}_OUTPUTS; ++i) {{ if (!(R_ABS(out[i]) < R(1e30))) {{ return 1; }} }}
    for (i = 0; i < N; ++i) {{ s->x[i] = x[i]; s->c[i] = c[i]; }}
    for (i = 0; i < {up}_PLAYS; ++i) {{ s->p[i] = settled[i]; }}
    for (i = 0; i < {up}_OUTPUTS; ++i) {{ y[i] = out[i]; }}
{newline.join(moved_on(k) for k in range(len(c.delays)))}
    ++s->count;
    return 0;
}}
"""
