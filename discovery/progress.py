"""What is being done, on stderr, while it takes longer than a moment, and how long it still takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Lock

Progress = Callable[[str], None]  # called with what begins

_TOO_SOON = 5.0  # s, before which nothing is said of the time left
_SHARE = 0.1  # done, at least, before it is


def silent(what: str) -> None:
    """A progress that nobody watches."""


class Steps:
    """A progress of steps whose relative lengths are known: says about how long the rest takes."""

    def __init__(
        self, progress: Progress, weights: Sequence[float], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._progress, self._all, self._clock = progress, sum(weights) or 1.0, clock
        self._began, self._done, self._whole = clock(), 0.0, 0.0
        self._lock = Lock()  # steps may run side by side

    def end(self, weight: float) -> None:
        """A step of this weight is done: what has passed says how long the whole takes."""
        with self._lock:
            self._done += weight
            share, passed = self._done / self._all, self._clock() - self._began
            self._whole = passed / share if share >= _SHARE and passed >= _TOO_SOON else 0.0

    def __call__(self, what: str) -> None:
        with self._lock:
            left = self._whole - (self._clock() - self._began)
            self._progress(f"{what} (about {_duration(left)} left)" if left > 0 else what)


def _duration(seconds: float) -> str:
    """A time that is roughly known."""
    if seconds >= 5400:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds / 60:.0f} min" if seconds >= 90 else f"{max(5, 5 * round(seconds / 5)):.0f} s"


@contextmanager
def shown(*, quiet: bool = False) -> Iterator[Progress]:
    """A line on stderr that says what is being done and for how long; plain lines where stderr is no
    terminal; nothing where it is to be quiet.
    """
    if quiet:
        yield silent
        return
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda what: console.print(what, highlight=False, markup=False)
        return
    with Bar(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    ) as bar:
        task = bar.add_task("starting", total=None)
        yield lambda what: bar.update(task, description=what)
