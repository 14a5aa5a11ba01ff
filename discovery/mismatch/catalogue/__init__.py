"""The catalogue of effects: one file per effect, found by being there."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example, Shape

__all__ = ["Amplitude", "Effect", "Example", "Shape", "catalogue"]


@cache
def catalogue() -> dict[str, Effect]:
    """Every effect of the catalogue by its word."""
    found = {}
    for module in sorted(iter_modules(__path__), key=lambda m: m.name):
        if module.name not in ("effect", "form", "worked"):
            entry: Effect = import_module(f"{__name__}.{module.name}").EFFECT
            found[entry.word] = entry
    return found
