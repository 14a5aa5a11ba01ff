"""Another process, for what takes longer than a tick."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

NICE = 10  # the ticks come first


@contextmanager
def other_process() -> Iterator[Executor]:
    """One process of low priority. It begins with the first question; at the end nobody waits for it."""
    found = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _begin)
    try:
        yield found
    finally:
        found.shutdown(wait=False, cancel_futures=True)


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the compensation ends it
    if hasattr(os, "nice"):
        os.nice(NICE)
