"""The catalogue of effects: one file per effect, found by being there."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from discovery.effects.form import Amplitude, Effect, Example, Shape

__all__ = ["Amplitude", "Effect", "Example", "Shape", "catalogue"]


@cache
def catalogue() -> dict[str, Effect]:
    """Every entry of the catalogue by the name of its file: the word of its effect.

    An effect that acts by two laws has a second file, whose name says more than the word.
    """
    modules = sorted(m.name for m in iter_modules(__path__))
    return {
        name: import_module(f"{__name__}.{name}").EFFECT
        for name in modules
        if name not in ("effect", "form", "worked")
    }
