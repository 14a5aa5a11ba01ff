"""The quick way into a file that is as it should be; whatever is odd about one is left to the careful way."""

from collections.abc import Collection
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from discovery.limits import check_shape
from discovery.recordings.clock import is_instant, parse_instant, seconds_between
from discovery.recordings.columns import EMPTY_CELLS, TIME, Array, Columns

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def read_quick_csv(data: bytes, wanted: Collection[str]) -> Columns | None:
    """The wanted columns of a CSV text in order (UTF-8, commas, decimal points); None when it is not."""
    import pyarrow as pa
    from pyarrow import csv

    first_line = data[:65536].partition(b"\n")[0]
    try:
        names = [name.strip() for name in first_line.decode("utf-8-sig").rstrip("\r").split(",")]
    except UnicodeDecodeError:
        return None
    if (
        any('"' in name for name in names)
        or len(set(names)) < len(names)
        or not {TIME, *wanted} <= set(names)
    ):
        return None
    second_line = data[len(first_line) + 1 : len(first_line) + 4096].decode("utf-8", "replace").split("\n")[0]
    instants = is_instant((second_line.split(",") + [""] * len(names))[names.index(TIME)])
    types = dict.fromkeys(wanted, pa.float64()) | {TIME: pa.string() if instants else pa.float64()}
    try:
        table = csv.read_csv(
            pa.BufferReader(data),
            read_options=csv.ReadOptions(column_names=names, skip_rows=1, use_threads=False),
            parse_options=csv.ParseOptions(ignore_empty_lines=False),
            convert_options=csv.ConvertOptions(
                column_types=types,
                include_columns=[TIME, *wanted],
                null_values=list(EMPTY_CELLS),
                strings_can_be_null=False,
            ),
        )
        return _columns(table, tuple(names), first_line_number=2)
    except (pa.ArrowInvalid, ValueError):
        return None


def read_parquet(path: Path, wanted: Collection[str]) -> Columns:
    """The wanted columns of a Parquet file; one that is missing is left out.

    Raises ValueError with what is wrong: not a Parquet file, no time column, a column of text;
    UserError: more rows than a recording has.
    """
    import pyarrow as pa
    from pyarrow import parquet

    try:
        with parquet.ParquetFile(path) as file:
            header = tuple(file.schema_arrow.names)
            present = [name for name in (TIME, *wanted) if name in header]
            check_shape(path, file.metadata.num_rows, len(present))
            table = file.read(columns=present, use_threads=False) if TIME in present else None
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise ValueError(
            f"not a readable Parquet file ({(str(error) or 'damaged').splitlines()[0]})"
        ) from None
    if len(set(header)) < len(header):
        doubled = next(name for name in header if header.count(name) > 1)
        raise ValueError(f"two columns are named '{doubled}'")
    if table is None:
        raise ValueError(f"no column '{TIME}'; the columns are {', '.join(header)}")
    for name in present[1:]:
        kind = table.schema.field(name).type
        if not (
            pa.types.is_integer(kind)
            or pa.types.is_floating(kind)
            or pa.types.is_boolean(kind)
            or pa.types.is_decimal(kind)
            or pa.types.is_null(kind)
        ):
            raise ValueError(f"column '{name}' holds {kind}, not numbers")
    return _columns(table, header, first_line_number=1)


def _columns(table: Any, header: tuple[str, ...], first_line_number: int) -> Columns:
    import pyarrow as pa

    stamps, kind = table.column(TIME), table.schema.field(TIME).type
    origin = None
    if pa.types.is_timestamp(kind) or pa.types.is_string(kind) or pa.types.is_large_string(kind):
        instants = [_instant(stamp) for stamp in stamps.to_pylist()]
        origin = instants[0].isoformat() if instants else None
        time = seconds_between(instants)
    elif pa.types.is_duration(kind):
        time = _floats(stamps.cast(pa.int64())) * _SECONDS[kind.unit]
    elif pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        time = _floats(stamps)
    else:
        raise ValueError(f"column '{TIME}' holds {kind}, neither seconds nor instants")
    values = {name: _floats(table.column(name)) for name in table.column_names if name != TIME}
    lines = np.arange(first_line_number, first_line_number + len(time))
    return Columns(header, time, values, lines, origin)


def _instant(stamp: datetime | str | None) -> datetime:
    if stamp is None:
        raise ValueError("a stamp is empty")
    if isinstance(stamp, str):
        return parse_instant(stamp)
    return stamp.astimezone(UTC) if stamp.tzinfo else stamp


def _floats(column: Any) -> Array:
    """Numbers as floats, (T,); null and NaN both mean not measured.

    Read from Arrow's own buffers: its conversions to numpy would import pandas.
    """
    import pyarrow as pa

    array = (column if column.type == pa.float64() else column.cast(pa.float64())).combine_chunks()
    if isinstance(array, pa.ChunkedArray):  # a column without rows stays chunked
        return np.zeros(0)
    valid, data = array.buffers()
    rows = slice(array.offset, array.offset + len(array))
    values = np.frombuffer(data, dtype=np.float64)[rows].copy()
    if valid is not None:
        known = np.unpackbits(np.frombuffer(valid, dtype=np.uint8), bitorder="little")[rows]
        values[known == 0] = np.nan
    return values
