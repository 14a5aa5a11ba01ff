"""What stands around a step in structured text: parameters that can be set, guards of the inputs, offsets."""

from __future__ import annotations

from discovery.export.document import Exported
from discovery.export.guarding import compensated, guard_numbers
from discovery.export.identifiers import identifiers
from discovery.export.st.language import literal


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


def configured(exported: Exported, kind: str) -> list[str]:
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


def guards(exported: Exported, kind: str) -> list[str]:
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


def offsets(exported: Exported, kind: str) -> list[str]:
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
