"""The output file: as safe as the state that says what was written to it.

Lines are flushed to the disk before the state is saved, and cut to what the state says after a restart: no
line is lost or written twice. A full disk keeps lines in memory until there is room again.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import BinaryIO

MOST_PENDING = 64_000_000  # bytes kept in memory while the disk is full


class Output:
    """Lines to a file, or to standard output where `path` is None.

    Args:
        header: first line of a new file.
        resume_at: bytes of the file at the time of a saved state; None: a new file.
        replay: lines after `resume_at` are made again, so they are cut off; if not, they are kept.
    """

    def __init__(self, path: Path | None, header: str, resume_at: int | None = None, *, replay: bool = True):
        self.path, self.header = path, header
        self.pending = b""
        self.lost = 0  # bytes that no memory was left for
        self.file: BinaryIO | None = None
        self.size = 0  # bytes that the file holds for certain
        if path is None:
            self.write(header)
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        goes_on = resume_at is not None and path.exists()
        self.file = path.open("r+b" if goes_on else "wb", buffering=0)
        if goes_on:
            self.size = self._whole(resume_at or 0, replay=replay)
            self.file.truncate(self.size)
            self.file.seek(self.size)
        if self.size == 0:
            self.write(header)

    def _whole(self, resume_at: int, *, replay: bool) -> int:
        """Where the file goes on: at the saved size, or after its last whole line."""
        assert self.file is not None
        size = self.file.seek(0, os.SEEK_END)
        if replay and size >= resume_at:
            return resume_at
        start = max(0, size - 65_536)
        self.file.seek(start)
        return start + self.file.read().rfind(b"\n") + 1

    def write(self, text: str) -> OSError | None:
        """Add a line; the error where the disk does not take it, which then is tried again with the next."""
        if self.path is None:
            sys.stdout.write(text)
            sys.stdout.flush()
            return None
        data = text.encode()
        if len(self.pending) + len(data) > MOST_PENDING:
            self.lost += len(data)
        else:
            self.pending += data
        return self.flush()

    def flush(self) -> OSError | None:
        """Hand what is pending to the disk; the error where it does not take it."""
        if self.file is None or not self.pending:
            return None
        try:
            self._follow()
            while self.pending:
                done = self.file.write(self.pending) or 0
                self.size += done
                self.pending = self.pending[done:]
        except OSError as error:
            return error
        return None

    def _follow(self) -> None:
        """Continue in a new file if the old one was moved away (log rotation)."""
        assert self.file is not None
        assert self.path is not None
        try:
            same = os.path.samestat(os.fstat(self.file.fileno()), self.path.stat())
        except FileNotFoundError:
            same = False
        if not same:
            self.file.close()
            self.file = self.path.open("wb", buffering=0)
            self.size, self.pending = 0, self.header.encode() + self.pending

    def sync(self) -> int | None:
        """Flush to the disk itself: bytes that are there to stay; None where some are still pending.

        Raises:
            OSError: the disk fails.
        """
        if self.file is None:
            return None
        error = self.flush()
        if error is not None:
            raise error
        os.fsync(self.file.fileno())
        return self.size

    def close(self) -> OSError | None:
        """Flush a last time; the error where lines are left that no disk took."""
        error = self.flush()
        if self.file is not None:
            self.file.close()
        return error
