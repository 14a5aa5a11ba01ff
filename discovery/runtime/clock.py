"""Time inside a running compensation: steady, whatever is done to the wall clock.

Inside, time begins at the wall clock of the start and goes on with a clock that nobody sets and that also
counts while the computer sleeps. A jump of the wall clock is an event, not an age.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

JUMP_S = 5.0  # a wall clock that moves by more between two ticks was set; less is followed silently


def steady_seconds() -> float:
    """Seconds since the computer was switched on, sleep included."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


def boot_id() -> str | None:
    """What differs from one start of the computer to the next; None where nobody says it."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return None


class Clock:
    """A steady clock that knows what the wall clock says.

    Args:
        steady, wall: seconds of both clocks (given by a test, or by a simulation).
        boot: see `boot_id`.
    """

    def __init__(
        self,
        steady: Callable[[], float] = steady_seconds,
        wall: Callable[[], float] = time.time,
        boot: str | None = None,
    ) -> None:
        self.steady, self.wall = steady, wall
        self.boot = boot if boot is not None else boot_id()
        self.zero = wall() - steady()  # inside = zero + steady
        self.ahead = 0.0  # of the wall clock before the time inside [s]

    def now(self) -> float:
        """The time inside [s]; it never goes back."""
        return self.zero + self.steady()

    def jumped(self) -> float:
        """By how much [s] the wall clock was set since the last call; 0: it was not."""
        ahead = self.wall() - self.now()
        moved, self.ahead = ahead - self.ahead, ahead
        return moved if abs(moved) > JUMP_S else 0.0

    def inside(self, stamp: float) -> float:
        """The time inside [s] of a stamp of the wall clock."""
        return stamp - self.ahead

    def saved(self) -> dict[str, float | str | None]:
        """For a saved state: what shows after a restart how long ago it was saved."""
        return {"inside": self.now(), "steady": self.steady(), "boot": self.boot}

    def resume(self, saved: dict[str, float | str | None]) -> None:
        """Go on with the time inside of a saved state, where the computer was not switched off since: then
        the gap is known, whatever happened to the wall clock.
        """
        inside, steady = saved.get("inside"), saved.get("steady")
        if self.boot is None or saved.get("boot") != self.boot:
            return
        if isinstance(inside, float) and isinstance(steady, float) and steady <= self.steady():
            self.zero = inside - steady
            self.ahead = self.wall() - self.now()
