"""Packages that come with an extra: imported where they are needed, so that the rest works without them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from discovery.errors import UserError


def need(package: str, extra: str, who: str) -> Any:
    """The package. `who`: what needs it, and the verb.

    Raises:
        UserError: it is not installed.
    """
    try:
        return import_module(package)
    except ImportError:
        raise UserError(f"{who} the extra '{extra}'; install discovery-workbench[{extra}]") from None
