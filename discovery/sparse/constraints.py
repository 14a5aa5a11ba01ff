"""Constraints of an experiment file on single terms (keep, forbid, bounds), matched to the terms of a
library.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.sparse.options import FAMILIES, SparseOptions
from discovery.terms import Name, names, parse, substitute, text

STATES = {"own": {"y"}, "rate": {"y", "rate"}, "upstream": {"y", "up"}}  # in expressions, by form


class UnknownTermError(UserError):
    """A term that a library does not have; another form of a model may."""


def matched(
    options: SparseOptions, offered: Sequence[str], path: Path, aliases: Mapping[str, str] | None = None
) -> SparseOptions:
    """The options with keep, forbid and bounds written as the library writes its terms.

    A temperature goes into a library as its difference from the room; its own name means that, too.

    Args:
        offered: terms of the library.
        path: of the campaign, for messages.
        aliases: further names, as {"y": "E_Y0C"}.

    Raises:
        UnknownTermError: a term that the library does not have.
    """
    known = {alias: Name(name) for alias, name in (aliases or {}).items()}

    def terms_of(word: str, key: str) -> list[str]:
        said = text(substitute(parse(word, f"{key} of the discovery"), known))
        found = [one for one in offered if one == said] or [o for o in offered if o.startswith(f"{said} - ")]
        if not found and not (key == "forbid" and options.form == "auto"):
            raise UnknownTermError(
                f"{path}: the discovery has '{word}' under {key}, which is not a term of its library; "
                f"write it as the library does: {', '.join(dict.fromkeys(offered))}"
            )
        return found

    bounds = {term: ends for word, ends in options.bounds.items() for term in terms_of(word, "bounds")}
    keep = tuple(term for word in options.keep for term in terms_of(word, "keep"))
    forbid = tuple(term for word in options.forbid for term in terms_of(word, "forbid"))
    return options.model_copy(update={"bounds": bounds, "keep": keep, "forbid": forbid})


def kept(labels: Mapping[str, str], options: SparseOptions, path: Path) -> list[str]:
    """Coefficients, of those with labels "state: term", that the options keep. Raises UnknownTermError."""
    terms = {name: label.split(": ", 1)[1] for name, label in labels.items()}
    stay = matched(options.model_copy(update={"bounds": {}, "forbid": ()}), [*terms.values()], path).keep
    return [name for name, term in terms.items() if term in stay]


def check_names(path: Path, words: Sequence[str], channels: Sequence[str], hidden: Sequence[str]) -> None:
    """Refuse an expression that names what is neither a channel nor a state of the forms that are tried.

    Raises:
        UserError: a name that none of these forms has.
    """
    known = {"time", *channels}.union(*(STATES[form] for form in hidden))
    for word in words:
        if word in FAMILIES:
            continue
        for name in sorted(names(parse(word, "library of the discovery")) - known):
            raise UserError(
                f"{path}: the library of the discovery names '{name}' in '{word}', which is "
                f"neither a family ({', '.join(FAMILIES)}) nor made of inputs and states "
                f"({', '.join(sorted(known))})"
            )
