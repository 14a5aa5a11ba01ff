"""Work in children of this process: each has all that its parent has, and sends back what it finds.

A pool of the standard library would have to pickle the work, and its children would stay behind where their
parent is killed. These end with their pipe.
"""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import current_process
from typing import Any, TypeVar

R = TypeVar("R")
T = TypeVar("T")


def can_fork() -> bool:
    """Whether this system has it, and its libraries stand it: those of macOS do not."""
    return sys.platform == "linux"


def is_child() -> bool:
    """Whether this process is such a child: it does not divide its work again."""
    return current_process().daemon


def forked(work: Callable[[T], R], items: Sequence[T], count: int) -> list[R]:
    """`work` on each item in their order, by `count` children of this process, which has no other threads.

    Raises:
        What goes wrong first, in the order of the items; what has not begun by then does not begin.
    """
    context = get_context("fork")
    ends: list[Connection[int, Any]] = []
    children = []
    gc.freeze()  # a child that looks for garbage among what it shares would copy all of it
    try:
        for _ in range(count):
            here, there = context.Pipe()
            child = context.Process(target=_work, args=(work, items, there, (*ends, here)), daemon=True)
            child.start()
            there.close()
            ends.append(here)
            children.append(child)
        found = _dealt(len(items), ends)
    finally:
        gc.unfreeze()
        for end in ends:
            end.close()
        for child in children:
            child.kill()
            child.join()
    # a child that the system has ended, for want of memory, leaves its item to its parent
    return [found[index] if index in found else work(item) for index, item in enumerate(items)]


def _dealt(count: int, ends: Sequence[Connection[int, Any]]) -> dict[int, Any]:
    """What the children find, by the index of the item: each gets the next one when it is done with the one
    before.
    """
    found: dict[int, Any] = {}
    failed: dict[int, BaseException] = {}
    left = iter(range(count))
    busy: dict[Connection[int, Any], int] = {}

    def deal(end: Connection[int, Any]) -> None:
        index = None if failed else next(left, None)
        if index is not None:
            with suppress(OSError):  # the child has ended
                end.send(index)
                busy[end] = index

    for end in ends:
        deal(end)
    while busy:
        ready = wait(list(busy))
        for end in [one for one in busy if one in ready]:
            index = busy.pop(end)
            try:
                good, what = end.recv()
            except (EOFError, OSError):  # the child has ended
                continue
            if good:
                found[index] = what
            else:
                failed[index] = what
            deal(end)
    if failed:
        raise failed[min(failed)]
    return found


def _work(
    work: Callable[[T], R],
    items: Sequence[T],
    end: Connection[Any, int],
    others: Sequence[Connection[int, Any]],
) -> None:
    """What a child does: it ends with the pipe, whatever becomes of its parent."""
    for other in others:
        other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent says when to stop
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    while True:
        try:
            index = end.recv()
        except EOFError:
            return
        what: tuple[bool, Any]
        try:
            what = True, work(items[index])
        except Exception as error:
            what = False, error
        try:
            end.send(what)
        except BrokenPipeError:  # the parent was killed
            return
