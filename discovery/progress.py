"""What is being done, on stderr, while it takes longer than a moment, and how long it still takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str], None]  # called with what begins

TOO_SOON = 5.0  # s: of less nothing is said


def silent(what: str) -> None:
    """A progress that nobody watches."""


def time_left(done: int, count: int, passed: float) -> str:
    """About how long the rest takes, at the speed seen; nothing where no step is done, or the last one.

    Args:
        done: steps that have ended, of `count` steps that are alike.
        passed: seconds since the first one began.

    >>> time_left(2, 10, 60.0), time_left(0, 10, 60.0), time_left(1, 10, 2.0)
    (', about 4 min left', '', '')
    """
    if not 0 < done < count or passed < TOO_SOON:
        return ""
    return f", about {rough(passed / done * (count - done))} left"


def rough(seconds: float) -> str:
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
