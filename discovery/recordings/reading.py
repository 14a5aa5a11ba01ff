"""From a file to columns: quick when the file is as it should be, careful when it is not."""

from collections.abc import Collection
from pathlib import Path

from discovery.errors import UserError
from discovery.limits import check_shape, read_table, regular
from discovery.recordings.careful import read_careful_csv
from discovery.recordings.columns import Columns
from discovery.recordings.finding import Finding
from discovery.recordings.quick import read_parquet, read_quick_csv

PARQUET_SUFFIXES = (".parquet", ".pq")


def read_columns(path: Path, wanted: Collection[str]) -> tuple[Columns | None, list[Finding]]:
    """The wanted columns of a CSV (plain or gzip) or Parquet file, and what is wrong with its text.

    A wanted column that the file does not have is left out; the columns are None when nothing is readable.
    Files that are no regular files, or larger than a recording (`discovery.limits`), are not read.
    """
    wanted = list(dict.fromkeys(wanted))  # two channels may read one column
    try:
        if path.suffix in PARQUET_SUFFIXES:
            return read_parquet(regular(path), wanted), []
        data = read_table(path)
        columns = read_quick_csv(data, wanted)
        if columns is not None and columns.runs_forward and columns.is_finite:
            check_shape(path, len(columns.time), len(columns.header))
            return columns, []
        return read_careful_csv(path, data, wanted)
    except UserError as error:
        return None, [_unreadable(path, str(error).removeprefix(f"{path}: "))]
    except ValueError as error:
        return None, [Finding("error", path, None, str(error), "write the file again")]


def _unreadable(path: Path, sentence: str) -> Finding:
    what, _, do = sentence.partition("; ")
    return Finding("error", path, None, what, do or "put it there, or correct the campaign file")
