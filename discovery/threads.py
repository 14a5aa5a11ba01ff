"""One thread for the linear algebra of a process: problems are small, and processes share the cores.

The command says so before numpy is loaded. A script has loaded it by then, so whatever computes for long pins
the libraries itself while it runs. What the user has set stays.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "VECLIB")
NAMES = tuple(f"{library}_NUM_THREADS" for library in _LIBRARIES)


def say_one_thread() -> None:
    """For this process and its children; it has no effect on libraries that are loaded already."""
    for name in NAMES:
        os.environ.setdefault(name, "1")


def one_thread(work: Callable[P, R]) -> Callable[P, R]:
    """`work` with one thread for linear algebra, whenever nothing was said about threads."""

    @wraps(work)
    def pinned(*args: P.args, **kwargs: P.kwargs) -> R:
        if any(name in os.environ for name in NAMES):
            return work(*args, **kwargs)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1):
            return work(*args, **kwargs)

    return pinned
