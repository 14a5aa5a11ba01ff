"""Files from outside: regular files alone, and never more of them in memory than a recording can need.

A pipe would block, a device never ends, and 4 MB of gzip can unpack to 4 GB. `SECURITY.md` lists the limits.
"""

from __future__ import annotations

import gzip
import os
import stat
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from discovery.errors import UserError

MOST_TEXT = 64 * 2**20  # bytes of a TOML or JSON file
MOST_UNPACKED = 2**30  # bytes of a table, unpacked: 30 columns at 10 Hz for four days
LARGE = 64 * 2**20  # bytes of a table above which it is read piece by piece
MOST_PIECEWISE = 64 * 2**30  # bytes of a table that is read piece by piece: a block of rows becomes a mean
MOST_LINE = 2**20  # bytes of one line
MOST_ROWS = 5_000_000  # in memory: 10 Hz for six days
MOST_COLUMNS = 4_000
MOST_CELLS = 100_000_000
_BLOCK = 2**20
_GZIP = b"\x1f\x8b"


def regular(path: str | os.PathLike[str]) -> Path:
    """The path of a regular file that can be read.

    Raises:
        UserError: no such file, a folder, a pipe, a socket or a device, or not readable.
    """
    path = Path(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise UserError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read ({_reason(error)})") from None
    if stat.S_ISDIR(mode):
        raise UserError(f"{path}: this is a folder; name a file in it")
    if not stat.S_ISREG(mode):
        raise UserError(
            f"{path}: this is not a regular file (a pipe or a device); copy its content to a file"
        )
    return path


def read_whole(path: str | os.PathLike[str], most: int = MOST_TEXT) -> bytes:
    """The unchanged bytes of a regular file.

    Raises:
        UserError: as `regular`, or larger than `most` bytes.
    """
    path = regular(path)
    try:
        with path.open("rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({_reason(error)})") from None
    if len(data) > most:
        raise UserError(f"{path}: larger than {_size(most)}; this is not a file of this kind")
    return data


def read_table(path: str | os.PathLike[str]) -> bytes:
    """The bytes of a table, unpacked where they are gzip.

    Raises:
        UserError: as `regular`; a damaged archive; more bytes, rows or longer lines than a recording has.
    """
    blocks: list[bytes] = []
    size = rows = line = 0
    for block in _blocks(regular(path)):
        size += len(block)
        rows += block.count(b"\n")
        newline = block.rfind(b"\n")
        line = len(block) - newline - 1 if newline >= 0 else line + len(block)
        if line > MOST_LINE:
            raise UserError(f"{path}: a line is longer than {_size(MOST_LINE)}; this is no text table")
        if rows > MOST_ROWS:
            raise UserError(
                f"{path}: more than {MOST_ROWS:,} rows; write it as plain CSV (UTF-8, commas, decimal "
                "points) or as Parquet, which are read piece by piece"
            )
        if size > MOST_UNPACKED:
            raise UserError(
                f"{path}: unpacks to more than {_size(MOST_UNPACKED)}; split or thin out the file"
            )
        blocks.append(block)
    return b"".join(blocks)


def long_head(path: str | os.PathLike[str]) -> bytes:
    """The first bytes, unpacked, of a table that is large enough to be read piece by piece; nothing of a
    smaller one.

    Raises:
        UserError: as `regular`; a damaged archive; larger than any recording.
    """
    path = regular(path)
    size = path.stat().st_size
    packed = path.suffix == ".gz"
    if size > (MOST_PIECEWISE // 20 if packed else MOST_PIECEWISE):
        raise UserError(f"{path}: larger than {_size(MOST_PIECEWISE)}; split the file, or write Parquet")
    return next(_blocks(path), b"") if size > (LARGE // 10 if packed else LARGE) else b""


def check_shape(path: str | os.PathLike[str], rows: int, columns: int) -> None:
    """Raises UserError where a table has more rows, columns or cells than a recording can have."""
    if columns > MOST_COLUMNS:
        raise UserError(f"{path}: {columns:,} columns; at most {MOST_COLUMNS:,} are read: leave some out")
    if rows > MOST_ROWS or rows * columns > MOST_CELLS:
        raise UserError(
            f"{path}: {rows:,} rows of {columns:,} columns; at most {MOST_ROWS:,} rows and {MOST_CELLS:,} "
            "cells are read: split or thin out the file"
        )


def _blocks(path: Path) -> Iterator[bytes]:
    """The content in blocks, unpacked."""
    try:
        with path.open("rb") as raw:
            packed = raw.read(2) == _GZIP
            raw.seek(0)
            file: IO[bytes] = gzip.GzipFile(fileobj=raw) if packed else raw  # type: ignore[assignment]
            while block := file.read(_BLOCK):
                yield block
    except (OSError, EOFError, zlib.error) as error:
        raise UserError(
            f"{path}: cannot be read ({_reason(error)}); copy or compress the file again"
        ) from None


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error) or "damaged"


def _size(count: int) -> str:
    return f"{count // 2**20} MB"
