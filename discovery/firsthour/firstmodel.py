"""First models by hand where nobody has made one yet: one or two thermal masses for each output."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import product

from discovery.firsthour.guess import Guess, drives, squared
from discovery.firsthour.measures import DEGREES
from discovery.models.units import per
from discovery.recordings.units import UnitError, conversion

_FAST, _SLOW = "5e-3", "2e-4"  # 1/s, where a fit begins: 3 minutes and 1.4 hours
# gains begin at zero: a load that no recording to fit shows warms nothing


def first_model(
    guesses: Mapping[str, Guess],
    outputs: Sequence[str],
    room: str | None,
    inputs: Sequence[str] = (),
    *,
    masses: int = 1,
) -> str:
    """Text of a model file.

    A temperature loses heat to the room and is warmed by the loads; loads and outputs that are numbered alike
    belong together. An error (no temperature) decays and is driven by each input. A second mass is coupled
    to each temperature, or adds to each error. A diagnosis then says what is missing.

    Args:
        room: channel of the air around, if there is one.
        inputs: of the errors.
    """
    roles = {name: one.role for name, one in guesses.items()}
    blocks = []
    for output in outputs:
        if roles[output] == "temperature":
            blocks.append(_temperature(output, guesses, room, outputs, masses))
        else:
            blocks.append(_error(output, guesses, inputs, masses))
    count = "first order" if masses == 1 else "two masses"
    lines = [
        "# The simplest model that could work. Improve it. Each output has its own equation.",
        f'name = "{count}"',
        "guessed = true   # delete this line once the start values are what you know of the machine",
        "",
        "[parameters]",
        *(line for block in blocks for line in block.parameters),
        "",
        "[states]   # what is measured starts at its first reading",
        *(line for block in blocks for line in block.states),
        "",
        *(line for block in blocks for line in block.terms),
    ]
    given = [line for block in blocks for line in block.outputs]
    return "\n".join([*lines, *(["[outputs]", *given, ""] if given else [])])


class _Block:
    """Lines of a model file that belong to one output."""

    def __init__(self) -> None:
        self.parameters: list[str] = []
        self.states: list[str] = []
        self.terms: list[str] = []
        self.outputs: list[str] = []

    def parameter(self, name: str, start: str, unit: str, *, least: str = "") -> str:
        limit = f", min = {least}" if least else ""
        self.parameters.append(f'{name} = {{ start = {start}, unit = "{unit}"{limit} }}')
        return name

    def term(self, name: str, into: str, expression: str) -> None:
        self.terms.append(f'[[terms]]\nname = "{name}"\ninto = "{into}"\nexpression = "{expression}"\n')


def _temperature(
    output: str, guesses: Mapping[str, Guess], room: str | None, outputs: Sequence[str], masses: int
) -> _Block:
    block = _Block()
    block.states.append(f'{output} = {{ unit = "{canonical(guesses[output])}" }}')
    if room:
        loss = block.parameter(f"loss_{output}", "1e-3", "1/s", least="0.0")
        block.term(f"{output} loses heat to the room", output, f"{loss}*({room} - {output})")
    for load in _belonging(output, drives(guesses), outputs):
        unit = canonical(guesses[load])
        # copper warms with the square of its current, a resistor with that of its voltage
        heat, power = (f"{load}**2", f"{unit}**2") if squared(guesses[load]) else (load, unit)
        # a load that is counted below zero, as a discharge is, may warm all the same
        least = "" if guesses[load].below_zero and heat == load else "0.0"
        gain = block.parameter(f"gain_{output}_{load}", "0.0", f"K{per(power)}/s", least=least)
        block.term(f"{load} warms {output}", output, f"{gain}*{heat}")
    for fan in [name for name, one in guesses.items() if one.quantity == "fan"] if room else []:
        more = block.parameter(f"{fan}_{output}", "1e-4", f"1/s{_per(canonical(guesses[fan]))}", least="0.0")
        block.term(f"{fan} cools {output}", output, f"{more}*{fan}*({room} - {output})")
    fluids, pumps = (
        [n for n, one in guesses.items() if one.role == role] for role in ("fluid temperature", "fluid flow")
    )
    for fluid, pump in product(fluids, pumps or [""]):  # which fluid a pump moves is for the fit to find
        of = [*[pump] * (len(pumps) > 1), *[fluid] * (len(fluids) > 1)]
        counts = _per(canonical(guesses[pump])) if pump else ""
        name = block.parameter("_".join(["fluid", *of, output]), "1e-4", f"1/s{counts}", least="0.0")
        which = "fluid" if len(fluids) == 1 else fluid
        which += f" with {pump}" if len(pumps) > 1 else ""
        block.term(f"{which} on {output}", output, f"{name}*{f'{pump}*' if pump else ''}({fluid} - {output})")
    if masses == 2:
        core = f"{output}_core"
        block.states.append(
            f'{core} = {{ unit = "degC", start = "{room}", start_sd = 5.0 }}'
            if room
            else f'{core} = {{ unit = "degC", start = 22.0, start_sd = 5.0 }}'
        )
        into = block.parameter(f"into_{core}", "2e-3", "1/s", least="0.0")
        back = block.parameter(f"back_{core}", "4e-4", "1/s", least="0.0")
        block.term(f"{core} on {output}", output, f"{into}*({core} - {output})")
        block.term(f"{output} on {core}", core, f"{back}*({output} - {core})")
    return block


def _per(unit: str) -> str:
    """What follows the unit of a number that counts for each one of another."""
    return "" if unit == "1" else f"/({unit})"


def _error(output: str, guesses: Mapping[str, Guess], inputs: Sequence[str], masses: int) -> _Block:
    block, unit = _Block(), canonical(guesses[output])
    if masses == 1:
        parts = {output: "1e-4"}
        block.states.append(f'{output} = {{ unit = "{unit}" }}')
    else:
        parts = {f"{output}_fast": _FAST, f"{output}_slow": _SLOW}
        block.states += [f'{part} = {{ unit = "{unit}", start = 0.0, start_sd = 20.0 }}' for part in parts]
        block.outputs.append(f'{output} = "{" + ".join(parts)}"')
    for k, (state, start) in enumerate(parts.items()):
        decay = block.parameter(f"decay_{state}", start, "1/s", least="1e-6")
        block.term(f"{state} decays", state, f"-{decay}*{state}")
        if k == len(parts) - 1:
            zero = block.parameter(f"zero_{state}", "0.0", f"{unit}/s")
            block.term(f"zero balance of {state}", state, zero)
        for name in inputs:
            other = canonical(guesses[name])
            other = {"degC": "K"}.get(other, other)
            heat = name
            if squared(guesses[name]):
                heat, other = f"{name}**2", f"{other}**2"
            gain = block.parameter(f"gain_{state}_{name}", "0.0", f"{unit}{per(other)}/s")
            block.term(f"{name} on {state}", state, f"{gain}*{heat}")
    return block


def usual_inputs(guesses: Mapping[str, Guess], room: str | None, *, thermal: bool = True) -> list[str]:
    """Channels that may drive an error: the air, fluids and temperatures, loads, else speeds, and
    switches; of other outputs every input.
    """
    temperatures = [
        name
        for name, one in guesses.items()
        if one.role in ("fluid temperature", "coolant temperature")
        or (one.role == "other input" and one.unit in DEGREES)
    ]
    others = [
        n
        for n, one in guesses.items()
        if one.quantity in ("fan", "flow")
        or one.role == "cooling power"
        or (not thermal and one.role == "other input")
    ]
    return list(dict.fromkeys([*([room] if room else []), *temperatures, *drives(guesses), *others]))


def _belonging(output: str, loads: Sequence[str], outputs: Sequence[str]) -> list[str]:
    """Return the loads that warm an output. If all are numbered, it is the load with the same number, else
    all loads.
    """
    number = {name: (re.findall(r"\d+", name) or [""])[-1] for name in [*loads, *outputs]}
    numbers = [number[load] for load in loads]
    paired = (
        "" not in numbers
        and sorted(numbers) == sorted(number[o] for o in outputs)
        and len(set(numbers)) == len(numbers)
    )
    return [load for load in loads if not paired or number[load] == number[output]]


def canonical(one: Guess) -> str:
    """The unit that values have once they are loaded."""
    try:
        return conversion(one.unit, one.role).unit
    except UnitError:  # the check of the campaign says so
        return one.unit
