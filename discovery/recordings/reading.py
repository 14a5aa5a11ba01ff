"""From a file to columns: quick when the file is as it should be, careful when it is not."""

from collections.abc import Collection
from pathlib import Path

from discovery.errors import UserError
from discovery.limits import check_shape, long_head, read_table, regular
from discovery.recordings.careful import read_careful_csv
from discovery.recordings.columns import Columns
from discovery.recordings.finding import Finding
from discovery.recordings.longfile import How
from discovery.recordings.quick import read_long_csv, read_parquet, read_quick_csv
from discovery.recordings.repeats import without_repeats

_READ: dict[tuple[object, ...], Columns] = {}  # what long files were reduced to
_MOST_READ = 8
PARQUET_SUFFIXES = (".parquet", ".pq")


def read_columns(
    path: Path, wanted: Collection[str], how: How | None = None
) -> tuple[Columns | None, list[Finding]]:
    """The wanted columns of a CSV (plain or gzip) or Parquet file, and what is wrong with its text.

    A wanted column that the file does not have is left out; the columns are None when nothing is readable.
    Rows that repeat one before them, stamp and all, are left out and counted.
    Files that are no regular files, or larger than a recording (`discovery.limits`), are not read.

    Args:
        how: what the columns are; then a long file is read piece by piece and becomes means (`longfile`).
    """
    wanted = list(dict.fromkeys(wanted))  # two channels may read one column
    key = (str(path), repr(wanted), repr(how), *_state(path))
    if key in _READ:  # a run looks at its recordings before it uses them
        return _READ[key], _repeated(path, _READ[key])
    columns, findings = _read(path, wanted, how)
    if columns is None:
        return None, findings
    if columns.counts:
        _READ[key] = columns
        while len(_READ) > _MOST_READ:
            _READ.pop(next(iter(_READ)))
    else:
        columns = without_repeats(columns)
    return columns, findings + _repeated(path, columns)


def _repeated(path: Path, columns: Columns) -> list[Finding]:
    if not columns.repeated:
        return []
    rows = "1 row repeats" if columns.repeated == 1 else f"{columns.repeated} rows repeat"
    do = "they are left out; nothing is lost if a logger sent them again"
    return [Finding("warning", path, None, f"{rows} an earlier row, stamp and values", do, "repeated")]


def _state(path: Path) -> tuple[int, int]:
    """What changes when a file is written anew."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return 0, 0
    return status.st_mtime_ns, status.st_size


def _read(path: Path, wanted: list[str], how: How | None) -> tuple[Columns | None, list[Finding]]:
    try:
        if path.suffix in PARQUET_SUFFIXES:
            return read_parquet(regular(path), wanted, how), []
        if how is not None and (head := long_head(path)):
            columns = read_long_csv(path, head, wanted, how)
            if columns is not None:
                return columns, []
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
