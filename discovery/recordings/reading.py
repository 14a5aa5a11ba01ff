"""From a file to columns: quick when the file is as it should be, careful when it is not."""

import gzip
import zlib
from collections.abc import Collection
from pathlib import Path

from discovery.recordings.careful import read_careful_csv
from discovery.recordings.columns import Columns
from discovery.recordings.finding import Finding
from discovery.recordings.quick import read_parquet, read_quick_csv

PARQUET_SUFFIXES = (".parquet", ".pq")


def read_columns(path: Path, wanted: Collection[str]) -> tuple[Columns | None, list[Finding]]:
    """The wanted columns of a CSV (plain or gzip) or Parquet file, and what is wrong with its text.

    A wanted column that the file does not have is left out; the columns are None when nothing is readable.
    """
    wanted = list(dict.fromkeys(wanted))  # two channels may read one column
    if path.suffix in PARQUET_SUFFIXES:
        try:
            return read_parquet(path, wanted), []
        except ValueError as error:
            return None, [Finding("error", path, None, str(error), "write the file again")]
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
    except (OSError, EOFError, zlib.error, ValueError) as error:
        return None, [_unreadable(path, error)]
    columns = read_quick_csv(data, wanted)
    if columns is not None and columns.runs_forward and columns.is_finite:
        return columns, []
    return read_careful_csv(path, data, wanted)


def _unreadable(path: Path, error: Exception) -> Finding:
    if isinstance(error, FileNotFoundError):
        do = "put it there or correct the campaign file"
        return Finding("error", path, None, "there is no such file", do)
    if isinstance(error, IsADirectoryError):
        return Finding("error", path, None, "this is a folder", "name a file in it in the campaign file")
    if isinstance(error, PermissionError):
        return Finding("error", path, None, "may not be read", "allow it, or copy the file")
    return Finding("error", path, None, f"cannot be read ({error})", "copy or compress the file again")
