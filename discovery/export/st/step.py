"""The statements of one call of the function block, the same as `stepper.INTEGRATOR` says them."""

from __future__ import annotations

from collections.abc import Sequence, Sized

from discovery.export.compiled import Compiled
from discovery.export.document import Exported
from discovery.export.guarding import times
from discovery.export.identifiers import identifiers
from discovery.export.kernel import LARGEST_NORM, LARGEST_SUBSTEPS, ORDER
from discovery.export.st.guards import configured, guards, offsets, settable
from discovery.export.st.language import literal, program_lines
from discovery.export.templated import templated


def step_text(exported: Exported, kind: str, function: str) -> str:
    """One call: guards, the start where needed, one step, modes, offsets. The model does not change where a
    number is not finite.
    """
    c = exported.compiled
    parameters = [word for word, _, _ in settable(exported)][: len(c.parameters)]
    rates = [*_places("f", c.states), *_places("a", c.nonzeros), *_moved(c)]
    step = literal(c.step_s, kind)
    lines = [
        *configured(exported, kind),
        f"dt := {kind}#0.0;",
        f"IF ticked THEN dt := {step}; END_IF;",
        "ticked := TRUE;",
        "fail_s := fail_s + dt;",
        "started_s := started_s + dt;",
        *guards(exported, kind),
        "failed := FALSE;",
        "IF known THEN",
        *_restart(c, kind, function, parameters),
        "IF running AND NOT failed THEN",
        f"t := DINT_TO_{kind}(count) * {step};",
        *_delayed(c, kind),
        *program_lines(c.rates, rates, kind, function, parameters),
        *_substeps(c, kind),
        *_increment(c, kind),
        *_new_states(c, kind),
        *_outputs(c, kind, function, parameters),
        *_taken_over(c),
        "END_IF;",
        "END_IF;",
    ]
    found = times()
    modes = templated(
        "modes.st",
        KIND=kind,
        RECOVER=literal(found["recover_s"], kind),
        SETTLE=literal(found["settle_s"], kind),
        FREEZE=literal(found["freeze_limit_s"], kind),
        HOLD=literal(found["hold_limit_s"], kind),
    )
    return _indented(lines) + "\n" + modes + _indented(offsets(exported, kind))


def _places(array: str, entries: Sized) -> list[str]:
    return [f"{array}[{k}]" for k in range(len(entries))]


def _moved(c: Compiled) -> list[str]:
    """Where the new values of the plays stand until a step has gone well."""
    return [f"m[{k}]" for k in range(c.plays)]


def _settled(c: Compiled) -> list[str]:
    return [f"p[{k}] := m[{k}];" for k in range(c.plays)]


def _fails(places: Sequence[str], kind: str) -> list[str]:
    """Write the checks that mark a call as failed if a number is not finite, or too large."""
    return [f"IF NOT (ABS({place}) < {kind}#1.0e30) THEN failed := TRUE; END_IF;" for place in places]


def _restart(c: Compiled, kind: str, function: str, parameters: Sequence[str]) -> list[str]:
    """Start values, delayed inputs as they always were; nothing changes where one is not finite."""
    first = [*_places("xn", c.states), *_moved(c)]
    rings = [
        line
        for k, delay in enumerate(c.delays)
        for line in (
            "k := 0;",
            f"WHILE k < {delay.length} DO "
            f"ring[{c.offsets[k]} + k] := u[{delay.input}]; k := k + 1; END_WHILE;",
            f"position[{k}] := 0;",
        )
    ]
    return [
        "IF restart OR NOT running THEN",
        *program_lines(c.start, first, kind, function, parameters),
        *_fails(first, kind),
        "IF NOT failed THEN",
        "running := TRUE;",
        "count := 0;",
        f"started_s := {kind}#0.0;",
        "settling := 1;",
        *(f"x[{i}] := xn[{i}]; c[{i}] := {kind}#0.0;" for i in range(len(c.states))),
        *_settled(c),
        *rings,
        "END_IF;",
        "END_IF;",
    ]


def _delayed(c: Compiled, kind: str) -> list[str]:
    """Each delayed input between the two values of its ring that it lies between."""
    lines = []
    for k, delay in enumerate(c.delays):
        length, part, ring = delay.length, literal(delay.part, kind), f"ring[{c.offsets[k]} + "
        lines += [
            f"here := (position[{k}] + 1) MOD {length};",
            f"{ring}here] := u[{delay.input}];",
            f"part := {kind}#1.0 - {part};",
            f"e[{k}] := part * {ring}(here + 2) MOD {length}] + {part} * {ring}(here + 1) MOD {length}];",
        ]
    return lines


def _substeps(c: Compiled, kind: str) -> list[str]:
    """How many sub-steps the largest row sum of the Jacobian asks for, and their length."""
    step = literal(c.step_s, kind)
    lines = [f"norm := {kind}#0.0;"]
    for row in range(len(c.states)):
        total = " + ".join(f"ABS(a[{k}])" for k, (i, _) in enumerate(c.nonzeros) if i == row)
        lines += [f"sum := {total or f'{kind}#0.0'};", "IF NOT (sum <= norm) THEN norm := sum; END_IF;"]
    most = literal(LARGEST_SUBSTEPS, kind)
    return [
        *lines,
        f"norm := norm * {step} / {literal(LARGEST_NORM, kind)};",
        f"IF NOT (norm < {most}) THEN failed := TRUE; norm := {kind}#0.0; END_IF;",
        "substeps := 1;",
        f"WHILE DINT_TO_{kind}(substeps) < norm DO substeps := substeps + 1; END_WHILE;",
        f"tau := {step} / DINT_TO_{kind}(substeps);",
    ]


def _increment(c: Compiled, kind: str) -> list[str]:
    """z = h phi1(h A) f by sub-steps, each by its Taylor series, as `kernel.increment`."""
    n = range(len(c.states))

    def product(source: str) -> list[str]:
        rows = [
            " + ".join(f"a[{k}] * {source}[{j}]" for k, (i, j) in enumerate(c.nonzeros) if i == row)
            for row in n
        ]
        return [f"w[{i}] := {row or f'{kind}#0.0'};" for i, row in enumerate(rows)]

    return [
        *(f"z[{i}] := {kind}#0.0;" for i in n),
        "k := 0;",
        "WHILE k < substeps DO",
        *product("z"),
        *(f"term[{i}] := (w[{i}] + f[{i}]) * tau; z[{i}] := z[{i}] + term[{i}];" for i in n),
        "j := 2;",
        f"WHILE j <= {ORDER} DO",
        *product("term"),
        f"sum := tau / DINT_TO_{kind}(j);",
        *(f"term[{i}] := w[{i}] * sum; z[{i}] := z[{i}] + term[{i}];" for i in n),
        "j := j + 1;",
        "END_WHILE;",
        "k := k + 1;",
        "END_WHILE;",
    ]


def _new_states(c: Compiled, kind: str) -> list[str]:
    """x + z by compensated summation."""
    return [
        line
        for i in range(len(c.states))
        for line in (
            f"sum := z[{i}] - c[{i}];",
            f"xn[{i}] := x[{i}] + sum;",
            f"cn[{i}] := (xn[{i}] - x[{i}]) - sum;",
            *_fails([f"xn[{i}]"], kind),
        )
    ]


def _outputs(c: Compiled, kind: str, function: str, parameters: Sequence[str]) -> list[str]:
    read = _places("y", c.outputs)
    return [
        f"t := DINT_TO_{kind}(count + 1) * {literal(c.step_s, kind)};",
        *program_lines(c.results, [*read, *_moved(c)], kind, function, parameters, "xn", "m"),
        *_fails(read, kind),
    ]


def _taken_over(c: Compiled) -> list[str]:
    """What a step that went well leaves for the next one."""
    return [
        "IF NOT failed THEN",
        *(f"x[{i}] := xn[{i}]; c[{i}] := cn[{i}];" for i in range(len(c.states))),
        *_settled(c),
        *(f"out_{word} := y[{k}];" for k, word in enumerate(identifiers(c.outputs))),
        *(f"position[{k}] := (position[{k}] + 1) MOD {d.length};" for k, d in enumerate(c.delays)),
        "count := count + 1;",
        "has_y := TRUE;",
        "END_IF;",
    ]


def _indented(lines: Sequence[str]) -> str:
    depth, out = 1, []
    for line in lines:
        closes = line.startswith(("END_IF", "END_WHILE"))
        depth -= closes
        out.append("  " * depth + line)
        opens = line.endswith((" THEN", " DO"))
        depth += opens
    return "\n".join(out)
