"""The quick way into a file that is as it should be; whatever is odd about one is left to the careful way."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from discovery.limits import check_shape
from discovery.recordings.clock import is_instant, parse_instant, seconds_between
from discovery.recordings.columns import EMPTY_CELLS, TIME, Array, Columns
from discovery.recordings.longfile import LONG, PIECE, How, Piece, Reduction
from discovery.recordings.repeats import Recent

_BLOCK = 2**24  # bytes of a CSV file at a time
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


@dataclass(frozen=True)
class Layout:
    """The columns of a CSV file and whether its stamps are instants."""

    names: tuple[str, ...]
    instants: bool

    def options(self, wanted: Collection[str]) -> dict[str, Any]:
        """For pyarrow's readers."""
        import pyarrow as pa
        from pyarrow import csv as pyarrow_csv

        types = dict.fromkeys(wanted, pa.float64()) | {TIME: pa.string() if self.instants else pa.float64()}
        return {
            "read_options": pyarrow_csv.ReadOptions(
                column_names=list(self.names), skip_rows=1, use_threads=False, block_size=_BLOCK
            ),
            "parse_options": pyarrow_csv.ParseOptions(ignore_empty_lines=False),
            "convert_options": pyarrow_csv.ConvertOptions(
                column_types=types,
                include_columns=[TIME, *wanted],
                null_values=list(EMPTY_CELLS),
                strings_can_be_null=False,
            ),
        }


def layout(head: bytes, wanted: Collection[str]) -> Layout | None:
    """Layout of a CSV file by what it begins with (UTF-8, commas, decimal points); None when it is not so."""
    first_line = head[:65536].partition(b"\n")[0]
    try:
        header = first_line.decode("utf-8-sig").rstrip("\r")
    except UnicodeDecodeError:
        return None
    try:
        names = [name.strip() for name in next(csv.reader([header]), [])]
    except csv.Error:  # a carriage return within the line: for the careful reader
        return None
    doubtful = (
        header.count('"') % 2 == 1 or any('"' in name for name in names) or len(set(names)) < len(names)
    )
    if doubtful or not {TIME, *wanted} <= set(names):
        return None
    second_line = head[len(first_line) + 1 : len(first_line) + 4096].decode("utf-8", "replace").split("\n")[0]
    cells = second_line.split(",") + [""] * len(names)
    return Layout(tuple(names), is_instant(cells[names.index(TIME)]))


def read_quick_csv(data: bytes, wanted: Collection[str]) -> Columns | None:
    """The wanted columns of a CSV text in order; None when it is not as `layout` wants it."""
    import pyarrow as pa
    from pyarrow import csv as pyarrow_csv

    form = layout(data, wanted)
    if form is None:
        return None
    try:
        table = pyarrow_csv.read_csv(pa.BufferReader(data), **form.options(wanted))
        return _columns(table, form.names, first_line_number=2)
    except (pa.ArrowInvalid, ValueError):
        return None


def read_long_csv(path: Path, head: bytes, wanted: Collection[str], how: How) -> Columns | None:
    """As `read_quick_csv`, piece by piece, of a file of any length (plain or gzip)."""
    import pyarrow as pa
    from pyarrow import csv as pyarrow_csv

    form = layout(head, wanted)
    if form is None:
        return None
    try:
        with (
            pa.input_stream(str(path), compression="detect" if path.suffix == ".gz" else None) as stream,
            pyarrow_csv.open_csv(stream, **form.options(wanted)) as batches,
        ):
            return _reduced(batches, form.names, 2, wanted, how)
    except (pa.ArrowInvalid, ValueError):
        return None


def read_parquet(path: Path, wanted: Collection[str], how: How | None = None) -> Columns:
    """The wanted columns of a Parquet file; one that is missing is left out.

    Args:
        how: what the columns are; then a long file is read by row groups and becomes means.

    Raises ValueError with what is wrong: not a Parquet file, no time column, a column of text;
    UserError: more rows than a recording has.
    """
    import pyarrow as pa
    from pyarrow import parquet

    try:
        with parquet.ParquetFile(path, pre_buffer=False, buffer_size=2**20) as file:
            header = tuple(file.schema_arrow.names)
            present = [name for name in (TIME, *wanted) if name in header]
            _check_columns(file.schema_arrow, header, present)
            rows = file.metadata.num_rows
            if how is not None and rows > LONG:
                batches = file.iter_batches(batch_size=PIECE, columns=present, use_threads=False)
                return _reduced(batches, header, 1, present[1:], how)
            check_shape(path, rows, len(present))
            return _columns(file.read(columns=present, use_threads=False), header, first_line_number=1)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise ValueError(
            f"not a readable Parquet file ({(str(error) or 'damaged').splitlines()[0]})"
        ) from None


def _check_columns(schema: Any, header: Sequence[str], present: Sequence[str]) -> None:
    """Raises ValueError: names twice, no time column, a column of text."""
    import pyarrow as pa

    if len(set(header)) < len(header):
        doubled = next(name for name in header if header.count(name) > 1)
        raise ValueError(f"two columns are named '{doubled}'")
    if TIME not in header:
        raise ValueError(f"no column '{TIME}'; the columns are {', '.join(header)}")
    numbers = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_decimal)
    for name in present[1:]:
        kind = schema.field(name).type
        if not any(is_a(kind) for is_a in (*numbers, pa.types.is_null)):
            raise ValueError(f"column '{name}' holds {kind}, not numbers")


def _columns(table: Any, header: tuple[str, ...], first_line_number: int) -> Columns:
    clock = Clock()
    time = clock.seconds(table.column(TIME))
    values = {name: _floats(table.column(name)) for name in table.column_names if name != TIME}
    lines = np.arange(first_line_number, first_line_number + len(time))
    return Columns(header, time, values, lines, clock.origin)


def _reduced(
    batches: Iterable[Any], header: tuple[str, ...], first_line: int, wanted: Collection[str], how: How
) -> Columns:
    """Columns of the batches of a long file; means where there are too many rows."""
    import pyarrow as pa

    clock, reduction, recent = Clock(), Reduction(how.held, how.only_at), Recent()
    left_out: dict[str, int] = {}
    for batch in batches:
        if not batch.num_rows:
            continue
        table = pa.Table.from_batches([batch])
        columns = {name: _floats(table.column(name)) for name in wanted}
        time, values = recent.new(clock.seconds(table.column(TIME)), columns)
        if any(np.isinf(column).any() for column in values.values()):
            raise ValueError("a number is infinite")
        for name, column in values.items():
            if count := how.clean(name, column):
                left_out[name] = left_out.get(name, 0) + count
        reduction.add(Piece(time, values))
    found = replace(reduction.columns(header, clock.origin, first_line), repeated=recent.count)
    return replace(found, left_out=left_out) if found.rows else found


@dataclass
class Clock:
    """Seconds of stamps, since the first one where they are instants."""

    first: datetime | int | None = None
    origin: str | None = None

    def seconds(self, stamps: Any) -> Array:
        """Seconds (T,) of a column of stamps. Raises ValueError: an empty stamp, or none of time."""
        import pyarrow as pa

        kind = stamps.type
        if pa.types.is_string(kind) or pa.types.is_large_string(kind):
            for zone in ("UTC", None):
                try:
                    return self._ticks(stamps, stamps.cast(pa.timestamp("us", zone)))
                except pa.ArrowInvalid:
                    continue
            return self._parsed(stamps)
        if pa.types.is_timestamp(kind):
            return self._ticks(stamps, stamps)
        if pa.types.is_duration(kind):
            return _floats(stamps.cast(pa.int64())) * _SECONDS[kind.unit]
        if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
            return _floats(stamps)
        raise ValueError(f"column '{TIME}' holds {kind}, neither seconds nor instants")

    def _ticks(self, stamps: Any, instants: Any) -> Array:
        import pyarrow as pa

        if stamps.null_count:
            raise ValueError("a stamp is empty")
        if not len(instants):
            return np.zeros(0)
        ticks, unit = instants.cast(pa.int64()), instants.type.unit
        if self.origin is None:
            self.first = ticks[0].as_py()
            shown = (
                stamps[0]
                if pa.types.is_string(stamps.type)
                else stamps[0].cast(_micro(stamps.type), safe=False)
            )
            self.origin = _instant(shown.as_py()).isoformat()
        counts = np.frombuffer(b"".join(chunk.buffers()[1].to_pybytes() for chunk in ticks.chunks), np.int64)
        assert isinstance(self.first, int)
        return np.asarray((counts - self.first) * _SECONDS[unit])

    def _parsed(self, stamps: Any) -> Array:
        instants = [_instant(stamp) for stamp in stamps.to_pylist()]
        if not instants:
            return np.zeros(0)
        if self.origin is None:
            self.first, self.origin = instants[0], instants[0].isoformat()
        assert isinstance(self.first, datetime)
        return seconds_between([self.first, *instants])[1:]


def _micro(kind: Any) -> Any:
    import pyarrow as pa

    return pa.timestamp("us", kind.tz)


def _instant(stamp: datetime | str | None) -> datetime:
    if stamp is None:
        raise ValueError("a stamp is empty")
    if isinstance(stamp, str):
        return parse_instant(stamp)
    return stamp.astimezone(UTC) if stamp.tzinfo else stamp


def _floats(column: Any) -> Array:
    """Return numbers as floats, (T,). Null and NaN both mean: not measured.

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
