"""Excel and Parquet as rows of words, like those of a text table."""

from __future__ import annotations

import zipfile
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.limits import MOST_UNPACKED, check_shape, regular

_ZIP, _OLD_EXCEL, _PARQUET = b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"PAR1"
_MOST_CELLS = 5_000_000  # of a worksheet: openpyxl reads some 200 000 a second


def is_workbook(path: Path) -> bool:
    """Whether a file is one of these, by its first bytes."""
    with regular(path).open("rb") as file:
        return file.read(4) in (_ZIP, _OLD_EXCEL, _PARQUET)


def read_workbook(path: Path) -> dict[str, list[tuple[int, list[str]]]]:
    """Rows with their numbers, by the name of the worksheet.

    Raises:
        UserError: another kind of archive, a damaged file, or one larger than a recording can be.
    """
    with path.open("rb") as file:
        kind = file.read(4)
    if kind == _OLD_EXCEL:
        raise UserError(f"{path}: a workbook of Excel before 2007; save it as .xlsx or CSV")
    return {"": _parquet(path)} if kind == _PARQUET else _excel(path)


def _excel(path: Path) -> dict[str, list[tuple[int, list[str]]]]:
    import warnings

    from openpyxl import load_workbook

    try:
        with zipfile.ZipFile(path) as archive:
            size, names = sum(one.file_size for one in archive.infolist()), archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise UserError(f"{path}: a damaged archive ({error}); save it again") from None
    if not any(name.startswith("xl/") for name in names):
        raise UserError(f"{path}: an archive, but no .xlsx; unpack it and name the table in it")
    if size > MOST_UNPACKED // 2:
        raise UserError(f"{path}: unpacks to more than {MOST_UNPACKED // 2**21} MB; save it as CSV")
    found = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # styles and extensions that openpyxl does not know
            book = load_workbook(path, read_only=True, data_only=True)
            for sheet in book.worksheets:
                rows: list[tuple[int, list[str]]] = []
                cells = 0
                for number, row in enumerate(sheet.iter_rows(values_only=True), start=1):
                    cells += len(row)
                    if cells > _MOST_CELLS:
                        raise UserError(f"{path}: more than {_MOST_CELLS:,} cells; save it as CSV")
                    words = [_word(value) for value in row]
                    if any(words):
                        rows.append((number, words))
                found[str(sheet.title)] = _trimmed(rows)
            book.close()
    except UserError:
        raise
    except Exception as error:  # openpyxl fails in many ways on a damaged file
        raise UserError(
            f"{path}: cannot be read as a workbook ({type(error).__name__}); save it again"
        ) from None
    return found


def _trimmed(rows: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Return rows of equal width, without empty columns on the left and right."""
    width = max((len(row) for _, row in rows), default=0)
    rows = [(k, row + [""] * (width - len(row))) for k, row in rows]
    used = [any(row[c] for _, row in rows) for c in range(width)]
    if not any(used):
        return []
    first, last = used.index(True), width - used[::-1].index(True)
    return [(k, row[first:last]) for k, row in rows]


def _word(value: Any) -> str:
    """Return a cell of a spreadsheet as a text table would write it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, timedelta):
        minutes, seconds = divmod(value.total_seconds(), 60.0)
        return f"{int(minutes) // 60}:{int(minutes) % 60:02d}:{seconds:06.3f}"
    return " ".join(str(value).split())


def _parquet(path: Path) -> list[tuple[int, list[str]]]:
    import pyarrow as pa
    from pyarrow import parquet

    try:
        with parquet.ParquetFile(path) as file:
            check_shape(path, file.metadata.num_rows, file.metadata.num_columns)
            if file.metadata.num_rows * file.metadata.num_columns > _MOST_CELLS:
                raise UserError(f"{path}: more than {_MOST_CELLS:,} cells; thin it out")
            table = file.read(use_threads=False)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise UserError(
            f"{path}: not a readable Parquet file ({(str(error) or 'damaged').splitlines()[0]})"
        ) from None
    names = list(table.column_names)
    columns = [[_word(value) for value in column.to_pylist()] for column in table.columns]
    rows = [list(row) for row in zip(*columns, strict=True)]
    return list(enumerate([names, *rows], start=1))
