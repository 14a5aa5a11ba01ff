"""Words explained: effects, models, roles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from discovery.errors import UsageError
from discovery.schema import suggest

if TYPE_CHECKING:
    from discovery.effects.form import Effect, Shape

MODELS = {
    "file": 'a model of your own: { file = "model.toml" }, a sparse sum of terms with named parameters',
    "regression": "ridge regression on the inputs, without memory: the minimum that a model has to beat",
    "reduced": "equation (9): each error first order, driven by all inputs together, fitted from one cycle",
    "superposition": "equation (8): each error a sum of parts, each first order and driven by one input",
    "thermobalance": "section 3: five bodies of a rotary table, cutting fluid by equations (1) to (6)",
    "sindy": "discovered: the fewest terms of a large library that predict parts of the data left out",
    "pysindy": "PySINDy with its usual settings, threshold by cross-validation: for comparison",
}

# the names that `discovery new` gives to the models of an experiment
FIRST_MODELS = {
    "regression": MODELS["regression"],
    "reduced": MODELS["reduced"],
    "first_order": "one thermal mass for each output, warmed by the inputs and cooled by the room",
    "two_masses": "two thermal masses for each output, a fast one and a slow one",
    "discovered": MODELS["sindy"].removeprefix("discovered: "),
    "pysindy": MODELS["pysindy"],
}

# what a role means where its name can be misread
_MEANT = {
    "fluid temperature": "cutting fluid, or what else wets parts from outside and may dry on them",
    "coolant temperature": "a liquid in pipes or channels: it never dries",
    "fluid flow": "of the cutting fluid or the coolant",
    "temperature": "a sensor that the errors follow is an 'other input'",
}


def list_words(what: str) -> Iterator[str]:
    """Lines on all effects, models or roles.

    Raises:
        UsageError: another word.
    """
    if what == "effects":
        yield from _effects()
    elif what == "models":
        yield from _pairs(MODELS.items())
    elif what == "roles":
        yield from _roles()
    else:
        raise UsageError(f"'{what}' cannot be listed; {suggest(what, ['effects', 'models', 'roles'])}")


def _effects() -> Iterator[str]:
    from discovery.effects.catalogue import catalogue

    groups = dict.fromkeys(effect.group for effect in catalogue().values())
    for group in groups:
        yield f"{group}:"
        yield from (
            f"  {line}"
            for line in _pairs((e.word, e.title) for e in catalogue().values() if e.group == group)
        )


def _roles() -> Iterator[str]:
    from discovery.recordings.roles import CORRECTION, ROLES

    for role, facts in ROLES.items():
        kind = (
            "output: models predict it at the times of its readings"
            if facts.measured
            else f"input, {facts.between} between its stamps"
        )
        if role in _MEANT:
            kind += f"; {_MEANT[role]}"
        if role == CORRECTION:
            kind = 'added to the readings of its error: corrects = "E_Y0C"'
        yield f"{role:20} {facts.said:12} {kind}"


def _pairs(pairs: Iterable[tuple[str, str]]) -> Iterator[str]:
    known = list(pairs)
    width = max(len(word) for word, _ in known)
    for word, text in known:
        yield f"{word:{width}}  {text}"


def explain(word: str) -> Iterator[str]:
    """What the catalogue knows of an effect: formula, size, signature, what it is confused with, source.

    Raises:
        UsageError: no such effect.
    """
    from discovery.effects.catalogue import catalogue

    known = catalogue()
    if word not in known:
        raise UsageError(f"there is no effect '{word}'; {suggest(word, sorted(known))}")
    for k, effect in enumerate(e for e in known.values() if e.word == known[word].word):
        yield from [""] * bool(k)
        yield from _entry(effect)


def _entry(effect: Effect) -> Iterator[str]:
    from discovery.effects.reading import gives, meanings, shown_example

    size = effect.amplitude
    sign = {1: ", positive", -1: ", negative"}.get(size.sign, ", either sign")
    yield f"{effect.title} ({effect.word}; {effect.group})"
    yield ""
    yield f"  formula        {effect.formula}"
    yield f"  gives          {gives(effect)}"
    for k, said in enumerate(meanings(effect)):
        yield f"  {'' if k else 'in which':13}  {said}"
    yield f"  acts on        {effect.place}{', or two linked ones' if effect.spreads else ''}"
    if size.fixed is None:
        usual = f"{size.name}, about {size.plausible:g} {size.unit}"
        yield f"  size           {usual} on machines of this class{sign}"
    for shape in effect.shapes:
        yield f"  shape          {shape.name} [{shape.unit}]: {_believed(shape)}"
    yield f"  signature      {effect.signature}"
    if effect.confused_with:
        yield f"  confused with  {_listed(effect.confused_with)}"
    for example in effect.examples:
        yield f"  example        {shown_example(effect, example)}"
    yield f"  source         {effect.source}"


def _believed(shape: Shape) -> str:
    """What is believed of a shape before recordings are read."""
    if shape.instant:
        return "searched for"
    if shape.middle is None:
        return "any that the recordings can show"
    within = f"a factor of {shape.factor:g}" if shape.factor else f"{shape.spread:g}"
    return f"about {shape.middle:g}, 68 % of machines within {within}"


def _listed(words: Sequence[str]) -> str:
    return ", ".join(words)
