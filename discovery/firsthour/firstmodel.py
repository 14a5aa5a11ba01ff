"""A first hand-built model where nobody has made one yet: first order, each output for itself."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from discovery.firsthour.guess import Guess, drives
from discovery.firsthour.words import CURRENTS, VOLTAGES
from discovery.recordings.units import UnitError, conversion


def first_model(guesses: Mapping[str, Guess], outputs: Sequence[str], *, has_room: bool) -> str:
    """Text of a model file.

    A temperature loses heat to the room and is warmed by the loads; loads and outputs that are numbered alike
    belong together. An error (no temperature) decays and is driven by each input. A diagnosis then says
    what is missing.
    """
    roles = {name: one.role for name, one in guesses.items()}
    room = (
        "T_env"
        if has_room
        else next((name for name, role in roles.items() if role == "ambient temperature"), None)
    )
    lines = [
        "# Written by `discovery new`: the simplest model that could work, to be bettered.",
        "# Each output for itself, first order.",
        'name = "first order"',
        "",
        "[parameters]",
    ]
    terms: list[str] = []
    parameters: list[str] = []
    for output in outputs:
        add = _temperature if roles[output] == "temperature" else _error
        found = add(output, guesses, room, outputs)
        parameters += found[0]
        terms += found[1]
    states = [f'{output} = {{ unit = "{_canonical(guesses[output])}" }}' for output in outputs]
    return "\n".join(
        [*lines, *parameters, "", "[states]   # each starts at its first reading", *states, "", *terms]
    )


def _temperature(
    output: str, guesses: Mapping[str, Guess], room: str | None, outputs: Sequence[str]
) -> tuple[list[str], list[str]]:
    parameters, terms = [], []
    if room:
        parameters.append(f'loss_{output} = {{ start = 1e-3, unit = "1/s", min = 0.0 }}')
        terms.append(_term(f"{output} loses heat to the room", output, f"loss_{output}*({room} - {output})"))
    for load in _belonging(output, drives(guesses), outputs):
        unit = _canonical(guesses[load])
        # copper warms with the square of its current, a resistor with that of its voltage
        squared = unit in (*CURRENTS, *VOLTAGES)
        heat, per = (f"{load}**2", f"{unit}**2") if squared else (load, unit)
        # a load that is counted below zero, as a discharge is, may warm all the same
        least = "" if guesses[load].below_zero and heat == load else ", min = 0.0"
        parameters.append(f'gain_{output}_{load} = {{ start = {_start(per)}, unit = "K/{per}/s"{least} }}')
        terms.append(_term(f"{load} warms {output}", output, f"gain_{output}_{load}*{heat}"))
    fluid, pump = _first(guesses, "fluid temperature"), _first(guesses, "fluid flow")
    if fluid:
        flow = _canonical(guesses[pump]) if pump else "1"
        per = "" if flow == "1" else f"/({flow})"
        parameters.append(f'fluid_{output} = {{ start = 1e-4, unit = "1/s{per}", min = 0.0 }}')
        terms.append(
            _term(
                f"fluid on {output}",
                output,
                f"fluid_{output}*{f'{pump}*' if pump else ''}({fluid} - {output})",
            )
        )
    return parameters, terms


def _error(
    output: str, guesses: Mapping[str, Guess], room: str | None, outputs: Sequence[str]
) -> tuple[list[str], list[str]]:
    del outputs
    unit = _canonical(guesses[output])
    parameters = [
        f'decay_{output} = {{ start = 1e-4, unit = "1/s", min = 1e-6 }}',
        f'zero_{output} = {{ start = 0.0, unit = "{unit}/s" }}',
    ]
    terms = [
        _term(f"{output} decays", output, f"-decay_{output}*{output}"),
        _term(f"zero balance of {output}", output, f"zero_{output}"),
    ]
    temperatures = [
        name
        for name, one in guesses.items()
        if one.role in ("fluid temperature", "coolant temperature")
        or (one.role == "other input" and one.unit in ("degC", "K"))
    ]
    loads = [name for name, one in guesses.items() if one.role == "heat load"]
    speeds = [] if loads else [name for name, one in guesses.items() if one.role == "rotation speed"]
    for name in [*([room] if room else []), *temperatures, *loads, *speeds]:
        per = "K" if name == room or name in temperatures else _canonical(guesses[name])
        parameters.append(f'gain_{output}_{name} = {{ start = 0.0, unit = "{unit}/{per}/s" }}')
        terms.append(_term(f"{name} on {output}", output, f"gain_{output}_{name}*{name}"))
    return parameters, terms


def _belonging(output: str, loads: Sequence[str], outputs: Sequence[str]) -> list[str]:
    """Loads that warm an output: the one of its number where all are numbered, else all."""
    number = {name: (re.findall(r"\d+", name) or [""])[-1] for name in [*loads, *outputs]}
    numbers = [number[load] for load in loads]
    paired = (
        "" not in numbers
        and sorted(numbers) == sorted(number[o] for o in outputs)
        and len(set(numbers)) == len(numbers)
    )
    return [load for load in loads if not paired or number[load] == number[output]]


def _canonical(one: Guess) -> str:
    """The unit that values have once they are loaded."""
    try:
        return conversion(one.unit, one.role).unit
    except UnitError:  # the check of the campaign says so
        return one.unit


def _start(unit: str) -> str:
    return "1e-3" if unit in ("percent", "1") else "1e-5"


def _first(guesses: Mapping[str, Guess], role: str) -> str | None:
    return next((name for name, one in guesses.items() if one.role == role), None)


def _term(name: str, into: str, expression: str) -> str:
    return f'[[terms]]\nname = "{name}"\ninto = "{into}"\nexpression = "{expression}"\n'
