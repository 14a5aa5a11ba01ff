"""What pydantic says about a file, as one sentence a person can act on."""

import types
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, NoReturn, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from discovery.errors import UserError

Key = tuple[str | int, ...]
_TABLE, _LIST = "a table, as { key = value }", 'a list, as ["a", "b"]'
_SHAPES = {"model_type": _TABLE, "dict_type": _TABLE, "list_type": _LIST, "tuple_type": _LIST}


class Strict(BaseModel):
    """The base of every file form: unknown keys are refused, numbers are finite and no texts, nothing changes
    after reading.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, strict=True, allow_inf_nan=False
    )


class Named(dict[str, Any]):
    """Things by name; a wrong name is a sentence with the nearest right one.

    >>> Named("recording", {"monday": 1})["mondy"]
    Traceback (most recent call last):
    ...
    discovery.errors.UserError: no recording 'mondy'; did you mean 'monday'? Allowed are: monday
    """

    def __init__(self, kind: str, things: Mapping[str, Any]) -> None:
        super().__init__(things)
        self.kind = kind

    def __missing__(self, name: str) -> NoReturn:
        raise UserError(f"no {self.kind} '{name}'; {suggest(str(name), list(self))}")

    def __reduce__(self) -> tuple[Any, ...]:
        return Named, (self.kind, dict(self))


def sentences(schema: type[BaseModel], data: Any, error: ValidationError) -> list[tuple[Key, str]]:
    """Every mistake in `data`: the key where it stands, and the rest of the sentence.

    Unknown keys come first, since a misspelt key is often the cause of a missing one. Of the branches of a
    union that all complain about one value, only the first is reported.
    """
    details = sorted(error.errors(include_url=False), key=lambda one: one["type"] != "extra_forbidden")
    mistakes: dict[tuple[Key, str | int | None], tuple[Key, str]] = {}
    for mistake in details:
        key = _real_key(data, mistake["loc"])
        missing = mistake["loc"][-1] if mistake["type"] == "missing" else None
        mistakes.setdefault((key, missing), (key, _explain(schema, mistake, key)))
    return list(mistakes.values())


def _real_key(data: Any, place: Key) -> Key:
    """`place` without the names of union branches and validators that pydantic mixes in."""
    key: Key = ()
    for part in place:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            continue
        key += (part,)
    return key


def _explain(schema: type[BaseModel], mistake: ErrorDetails, key: Key) -> str:
    kind, given = mistake["type"], mistake["input"]
    context = mistake.get("ctx", {})
    if kind == "extra_forbidden":
        return f"unknown key; {suggest(str(key[-1]), _known_keys(schema, mistake['loc'][:-1]))}"
    if kind == "missing":
        return f"the key '{mistake['loc'][-1]}' is missing"
    if kind in ("literal_error", "enum"):
        word = _short(given)
        return f"{word} is not known; {suggest(word.strip(chr(39)), _quoted(context['expected']))}"
    if kind == "union_tag_invalid":
        known = suggest(context["tag"], _quoted(context["expected_tags"]))
        return f"kind {context['tag']!r} is not known; {known}"
    if kind in _SHAPES:
        return f"should be {_SHAPES[kind]}, not {_short(given)}"
    if kind == "too_short":
        return f"is empty; it needs at least {context['min_length']}"
    if kind in ("value_error", "assertion_error"):
        return str(context["error"])
    what = mistake["msg"].replace("Input should be", "should be").removesuffix(".")
    return f"{what}, not {_short(given)}"


def _quoted(listing: str) -> list[str]:
    return [word.strip().strip("'") for word in listing.replace(" or ", ", ").split(", ")]


def suggest(word: str, allowed: list[str]) -> str:
    """The known word nearest to a mistaken one, and all of them.

    >>> suggest("unitt", ["role", "unit"])
    "did you mean 'unit'? Allowed are: role, unit"
    >>> suggest("T_enf", ["T_env", "E_Y0C"])
    "did you mean 'T_env'? Allowed are: T_env, E_Y0C"
    """
    plain = {name.lower(): name for name in allowed}
    near = get_close_matches(word.lower(), plain, n=1, cutoff=0.6)
    hint = f"did you mean '{plain[near[0]]}'? " if near else ""
    text = f"{hint}allowed are: {', '.join(allowed)}" if allowed else "none is allowed here"
    return text.replace("? allowed", "? Allowed")


def _known_keys(schema: Any, place: Key) -> list[str]:
    """The keys that a table may hold at a place as pydantic names it, with the kind chosen among several."""
    found = [schema]
    for part in place:
        chosen = [one for one in found if _kind(one) == part]
        found = chosen or [inner for one in found for inner in _step(one, part)]
    names: dict[str, None] = {}
    for one in found:
        if _is_model(one):
            names |= dict.fromkeys(field.alias or name for name, field in one.model_fields.items())
    return list(names)


def _kind(annotation: Any) -> Any:
    """What a table has to say as its kind; None where it has none."""
    field = annotation.model_fields.get("kind") if _is_model(annotation) else None
    return field and next(iter(get_args(field.annotation)), None)


def _step(annotation: Any, part: str | int) -> list[Any]:
    """The types that the value of `part` may have inside a value of the type `annotation`."""
    if _is_model(annotation):
        inner = [
            field.annotation for name, field in annotation.model_fields.items() if part in (name, field.alias)
        ]
    else:
        inner = list(get_args(annotation)[-1:] if get_origin(annotation) is not None else [])
    return [one for annotation in inner for one in _branches(annotation)]


def _branches(annotation: Any) -> list[Any]:
    """A union's members, the thing itself otherwise; names put on with Annotated are taken off."""
    if get_origin(annotation) in (Union, types.UnionType):
        return [one for branch in get_args(annotation) for one in _branches(branch)]
    if hasattr(annotation, "__metadata__"):
        return _branches(annotation.__origin__)
    return [annotation]


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _short(value: object) -> str:
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write out an integer of thousands of digits
        return "an integer of thousands of digits"
    return text if len(text) <= 40 else f"{text[:37]}..."
