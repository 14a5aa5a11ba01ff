"""How the cores are used: independent fits run side by side, each with one thread for its linear algebra.

Problems are small: threads inside a matrix product would only get in each other's way. The command says so
before numpy is loaded. A script has loaded it by then, so whatever computes for long pins the libraries
itself while it runs. What the user has set stays.

Half of a fit is Python, which the threads of one process cannot do side by side. So a command forks
(`forked.py`). A process that has threads already cannot do that safely, a notebook or a worker of a cluster:
there, fits are threads.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from functools import wraps
from typing import ParamSpec, TypeVar

from discovery.forked import can_fork, forked, is_child

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "VECLIB")
NAMES = tuple(f"{library}_NUM_THREADS" for library in _LIBRARIES)


JOBS = "DISCOVERY_JOBS"  # environment variable: fits at a time; `--jobs` sets it

FIT = "fit"  # names of the threads of fits begin so


def jobs() -> int:
    """Fits at a time: what the user has set, else the cores that this process may use."""
    said = os.environ.get(JOBS, "")
    if said.isdigit() and int(said) > 0:
        return int(said)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def use_jobs(count: int | None) -> None:
    """For this process and its children: so many fits at a time; None changes nothing."""
    if count is not None:
        os.environ[JOBS] = str(count)


def side_by_side(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """`work` on each item, in their order; the same results with any number of jobs.

    What goes wrong first, in the order of the items, is raised; what has not begun by then does not begin.
    """
    count = min(jobs(), len(items))
    if count < 2 or is_child():
        return [work(item) for item in items]
    if threading.active_count() == 1 and can_fork():
        return forked(work, items, count)
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(count, thread_name_prefix=FIT)
    try:
        return list(pool.map(work, items))
    finally:  # nobody waits for what is under way: an interrupt ends the command at once
        pool.shutdown(wait=False, cancel_futures=True)


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
