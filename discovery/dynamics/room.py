"""Memory for the arrays of a free run, kept from one to the next."""

from __future__ import annotations

import os
import sys

_KEPT = 64 << 20  # bytes of free memory that a process keeps
_LARGE = 32 << 20  # bytes of an array that gets memory of its own, which is given back at once
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt(3)


def keep_room() -> None:
    """Let glibc keep what is freed, as it does by itself once an array of 32 MB has been freed.

    Before that it gives back each array of a free run, and the system has to clear new pages for the next
    one: two thirds of its time. Other libraries of C, and what the user has set, are left as they are.
    """
    if sys.platform != "linux" or any(name.startswith("MALLOC_") for name in os.environ):
        return
    import ctypes

    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError):
        return
    mallopt(_MMAP_THRESHOLD, _LARGE)
    mallopt(_TRIM_THRESHOLD, _KEPT)
