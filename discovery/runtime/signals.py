"""What an operator or a service manager says by a signal: stop, or acknowledge."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Stopped(Exception):  # noqa: N818
    """SIGTERM or SIGINT came."""


class Asked:
    """What was asked for since the last tick. A tick is never torn: it is finished first."""

    def __init__(self) -> None:
        self.stop = False
        self.acknowledge = False
        self._busy = False

    def acknowledged(self) -> bool:
        """Whether an acknowledge came; it counts once."""
        found, self.acknowledge = self.acknowledge, False
        return found

    @contextmanager
    def busy(self) -> Iterator[None]:
        """A tick: a stop waits for its end."""
        self._busy = True
        yield
        self._busy = False
        if self.stop:
            raise Stopped

    def on_stop(self, _: int = 0, __: FrameType | None = None) -> None:
        """SIGTERM, SIGINT."""
        self.stop = True
        if not self._busy:
            raise Stopped

    def on_acknowledge(self, _: int = 0, __: FrameType | None = None) -> None:
        """SIGUSR1."""
        self.acknowledge = True


@contextmanager
def listening() -> Iterator[Asked]:
    """Hear signals while the context lasts (in the main thread; elsewhere nothing is heard)."""
    asked = Asked()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    wanted = {
        signal.SIGTERM: asked.on_stop,
        signal.SIGINT: asked.on_stop,
        signal.SIGUSR1: asked.on_acknowledge,
    }
    before = {number: signal.signal(number, handler) for number, handler in wanted.items()}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
