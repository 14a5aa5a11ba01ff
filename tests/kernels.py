"""Tests that run side by side compile each kernel once: who comes second waits, and loads it."""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import Any

from numba.core.dispatcher import Dispatcher


def compile_in_turn() -> None:
    """One process at a time compiles a function that is kept on disk; without this, all do, and what one
    keeps may be lost to another.
    """
    compiled = Dispatcher.compile
    held: set[Path] = set()

    def in_turn(self: Any, signature: Any) -> Any:
        folder = self._cache.cache_path
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}.lock"
        if folder is None or Path(folder, name) in held:
            return compiled(self, signature)
        path = Path(folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        held.add(path)
        try:
            with path.open("w") as file:
                fcntl.flock(file, fcntl.LOCK_EX)
                return compiled(self, signature)
        finally:
            held.remove(path)

    Dispatcher.compile = in_turn  # type: ignore[assignment,method-assign]
