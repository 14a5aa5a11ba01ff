"""How to read the formula of an effect: what it gives, what its names mean, its worked examples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite

from discovery.effects.form import INPUT, LEVEL, RATE, ROLE_OF, TERM, TERM_PLACES, Effect, Example
from discovery.terms import names, parse

_GIVES = {
    "inputs of a recording": "what each recorded input becomes in the terms of the model",
    "error state": "a rate of the error, added to the rates that the model has without the effect",
    "seat": "K, added to the temperature of the body where all errors see it",
    "lever": "what an error shows in addition to what the model predicts without the effect",
    "thermometer": "what a temperature shows in addition to what the model predicts without the effect",
}
_SHOWN = "what the output shows in addition to what the model predicts without the effect"
_BECOMES = "what the channel becomes in the terms of the model where it stands"
_CHANGE = "the change of a term of the model, in the unit of the term; without the effect the term acts alone"
_FLOW = "a heat flow in W into body{out}, added to all heat flows that the model has without the effect"
_MEANS = {
    "body": "temperature of the body",
    "other": "temperature of the other body",
    "y": "what the output shows without the effect",
    "time": "time since the start of the recording, in s",
    TERM: "the term of the model, without the effect",
    INPUT: "a recorded input",
    LEVEL: "a recorded input over its largest recorded value",
    RATE: "a flow over its largest recorded value",
}
_FUNCTIONS = {
    "lag": "lag(x, t): x behind a first-order lag of the time constant t",
    "delay": "delay(x, t): x at t seconds before",
    "play": "play(x, w): x with a backlash of the width w on either side",
}


def gives(effect: Effect) -> str:
    """What the value of the formula is, and what there is without the effect."""
    used = names(parse(effect.formula))
    if TERM in used:
        return _CHANGE
    if effect.place in TERM_PLACES:
        return _BECOMES
    if effect.place.startswith("output") or effect.place == "recording":
        return _SHOWN
    exchange = effect.place != "driven and another" and "other" in used
    return _GIVES.get(effect.place, _FLOW.format(out=" and out of other" if exchange else ""))


def meanings(effect: Effect) -> Iterator[str]:
    """What each name and each function with a memory in the formula means."""
    for name in sorted(names(parse(effect.formula)), key=effect.formula.index):
        if name in ROLE_OF:
            yield f"{name}: channel of the role '{ROLE_OF[name]}'"
        elif name in _MEANS:
            of_error = effect.place == "error state" and name == "body"
            yield f"{name}: {'the error' if of_error else _MEANS[name]}"
    yield from (said for function, said in _FUNCTIONS.items() if f"{function}(" in effect.formula)


def shown_example(effect: Effect, example: Example) -> str:
    """A worked example: values, what held before them, and what the formula gives."""

    def listed(values: Mapping[str, float]) -> str:
        return ", ".join(f"{name} = {value:g}" for name, value in values.items())

    said = listed(example.values)
    if example.before:
        when = f"for {example.since:g} s" if isfinite(example.since) else "now"
        said += f" {when}, before that {listed(example.before)}"
    unit = " W" if gives(effect).startswith("a heat flow") else ""
    return f"{said}: {example.expected:g}{unit}"
