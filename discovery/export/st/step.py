"""The statements of one call of the function block, the same as `stepper.INTEGRATOR` says them."""

from __future__ import annotations

from collections.abc import Sequence, Sized

from discovery.export.compiled import Compiled
from discovery.export.document import Exported
from discovery.export.guarding import compensated, guard_numbers, times
from discovery.export.identifiers import identifiers
from discovery.export.kernel import LARGEST_NORM, LARGEST_SUBSTEPS, ORDER
from discovery.export.st.language import literal, program_lines
from discovery.export.templated import templated


def settable(exported: Exported) -> list[tuple[str, str, float]]:
    """Variable, name and default of all that `set_parameter` can change, in the order of its numbers."""
    c = exported.compiled
    names = [name for name, _ in c.parameters]
    found = [
        (f"par_{word}", name, value)
        for word, (name, value) in zip(identifiers(names), c.parameters, strict=True)
    ]
    outputs = [exported.outputs[k] for k in compensated(exported)]
    words = identifiers([o.name for o in outputs])
    found += [(f"limit_{word}", o.name, o.range.limit) for word, o in zip(words, outputs, strict=True)]
    return found + [(f"rate_{word}", o.name, o.range.rate) for word, o in zip(words, outputs, strict=True)]


def step_text(exported: Exported, kind: str, function: str) -> str:
    """One call: guards, the start where needed, one step, modes, offsets. The model does not change where a
    number is not finite.
    """
    c = exported.compiled
    parameters = [word for word, _, _ in settable(exported)][: len(c.parameters)]
    rates = [*_places("f", c.states), *_places("a", c.nonzeros), *_moved(c)]
    step = literal(c.step_s, kind)
    lines = [
        *_configured(exported, kind),
        f"dt := {kind}#0.0;",
        f"IF ticked THEN dt := {step}; END_IF;",
        "ticked := TRUE;",
        "fail_s := fail_s + dt;",
        "started_s := started_s + dt;",
        *_guards(exported, kind),
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
    return _indented(lines) + "\n" + modes + _indented(_offsets(exported, kind))


def _configured(exported: Exported, kind: str) -> list[str]:
    """Defaults at the first call, and the one parameter that is set now."""
    found = settable(exported)
    lines = [
        "IF NOT configured THEN",
        "configured := TRUE;",
        f"good_s := (-{kind}#1.0);",
        "settling := 1;",
        *(f"{word} := {literal(value, kind)};" for word, _, value in found),
        "END_IF;",
    ]
    for k, (word, _, _) in enumerate(found, start=1):
        lines.append(f"IF set_parameter = {k} THEN {word} := set_value; END_IF;")
    return lines


def _guards(exported: Exported, kind: str) -> list[str]:
    """Each input through its guard; what they say together."""
    words = identifiers(exported.compiled.inputs)
    lines = ["known := TRUE;", "replaced := FALSE;", f"gain := {kind}#1.0;", f"oldest_held := {kind}#0.0;"]
    lines += [f"bit_{k} := FALSE;" for k in (8, 9, 10, 11, 12, 13)]
    steps = [word for word, spec in zip(words, exported.inputs, strict=True) if spec.range.step is not None]
    for k, word in enumerate(words):  # the steps of the call before: no guard sees one of its own call
        others = [
            f"(guard_{word}.direction <> 0 AND guard_{other}.direction = guard_{word}.direction)"
            for other in steps
            if other != word and word in steps
        ]
        lines.append(f"together[{k}] := {' OR '.join(others) or 'FALSE'};")
    for k, (word, spec) in enumerate(zip(words, exported.inputs, strict=True)):
        g = guard_numbers(spec)
        numbers = {
            "trained_from": g.low,
            "trained_to": g.high,
            "width": g.span,
            "possible_from": g.plausible_low,
            "possible_to": g.plausible_high,
            "jump": g.step,
            "drift": g.rate,
            "oldest": g.age,
            "sudden": g.sudden,
            "still": g.still,
        }
        given = ", ".join(f"{name} := {literal(value, kind)}" for name, value in numbers.items())
        lines += [
            f"guard_{word}(reading := in_{word}, good := ok_{word}, together := together[{k}], "
            f"acknowledge := acknowledge, guards := guards, fade := fade, dt := dt, {given});",
            f"u[{k}] := guard_{word}.used;",
            f"IF NOT guard_{word}.known THEN known := FALSE; END_IF;",
            f"IF guard_{word}.fault <> 0 THEN replaced := TRUE; END_IF;",
            f"IF guard_{word}.gain < gain THEN gain := guard_{word}.gain; END_IF;",
            f"IF guard_{word}.gain < {kind}#1.0 THEN bit_13 := TRUE; END_IF;",
            f"IF guard_{word}.held_age > oldest_held THEN oldest_held := guard_{word}.held_age; END_IF;",
            *(f"IF guard_{word}.fault = {n} THEN bit_{n + 7} := TRUE; END_IF;" for n in range(1, 6)),
        ]
    return lines


def _offsets(exported: Exported, kind: str) -> list[str]:
    """Offsets on their way to their targets, and the status word."""
    lines = ["bit_18 := FALSE;", "bit_19 := FALSE;"]
    places = compensated(exported)
    words = identifiers([exported.outputs[k].name for k in places])
    predicted = identifiers(exported.compiled.outputs)
    for place, word in zip(places, words, strict=True):
        offset = f"offset_{word}"
        lines += [
            f"target := {offset};",
            f"IF mode = 0 OR mode = 6 THEN target := {kind}#0.0;",
            f"ELSIF mode <> 5 AND has_y THEN target := {kind}#0.0 - gain * out_{predicted[place]}; END_IF;",
            f"IF NOT (ABS(target) < {kind}#1.0e30) THEN target := {offset}; END_IF;",
            "IF limits THEN",
            f"IF target > limit_{word} THEN target := limit_{word}; bit_18 := TRUE; END_IF;",
            f"sum := {kind}#0.0 - limit_{word};",
            "IF target < sum THEN target := sum; bit_18 := TRUE; END_IF;",
            f"sum := rate_{word} * dt;",
            f"IF target - {offset} > sum THEN target := {offset} + sum; bit_19 := TRUE; END_IF;",
            f"IF {offset} - target > sum THEN target := {offset} - sum; bit_19 := TRUE; END_IF;",
            "END_IF;",
            f"{offset} := target;",
        ]
    lines.append("status := mode;")
    bits = (8, 9, 10, 11, 12, 13, 18, 19)
    return lines + [f"IF bit_{k} THEN status := status + {1 << k}; END_IF;" for k in bits]


def _places(array: str, entries: Sized) -> list[str]:
    return [f"{array}[{k}]" for k in range(len(entries))]


def _moved(c: Compiled) -> list[str]:
    """Where the new values of the plays stand until a step has gone well."""
    return [f"m[{k}]" for k in range(c.plays)]


def _settled(c: Compiled) -> list[str]:
    return [f"p[{k}] := m[{k}];" for k in range(c.plays)]


def _fails(places: Sequence[str], kind: str) -> list[str]:
    """The call fails where a number is not finite, or as good as."""
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
