"""Where the names of the columns stand, the units next to them, and what explains a name further up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.firsthour.cells import holds_word, is_empty, is_number, is_stamp, is_switch
from discovery.firsthour.measures import is_unit, known_unit, steps_in, time_unit

Row = tuple[int, list[str]]
"""Number of the line, and its cells."""

_A_RUN = 10  # rows of readings that follow each other: settings above a table have fewer


def find_header(
    path: Path, head: Sequence[Row], first: int | None, width: int
) -> tuple[int, list[str], list[str]]:
    """Find the names of the columns, the units below or above them, and the words over groups of names.

    Args:
        head: the first lines of the file.
        first: the first line that is data, by its place in `head`; None: no line is.
        width: number of columns.

    Returns:
        The place of the names in `head`, a unit (or "") and a group (or "") for each column.

    Raises:
        UserError: no line could be the names, or it has too many or too few of them.
    """
    if first == 0:
        raise UserError(
            f"{path}, line {head[0][0]}: numbers where the names of the columns should be; "
            f"put a line of {width} names above them, such as time,heater,T1"
        )
    end = len(head) if first is None else first
    rows = [(k, fitted(head[k][1], width)) for k in range(end)]
    full = [(k, cells) for k, cells in rows if cells is not None]
    if not full:
        _compare(path, head[:end], width)
        raise UserError(
            f"{path}: no header above the rows of {width} cells; write {width} names, starting with time"
        )
    if first is None:  # nothing can be read as data: the fullest row is the header
        at = max(full, key=lambda one: (sum(map(bool, one[1])), -one[0]))[0]
        return at, [""] * width, [""] * width
    block = [(k, _without_labels(cells)) for k, cells in full]
    units = [""] * width
    like = max(block, key=lambda one: (_units(one[1]), one[0]))
    if len(block) > 1 and _units(like[1]) >= 0.5:
        units, block = like[1], [one for one in block if one is not like]
    at = max(block, key=lambda one: (_said(one[1]), one[0]))[0]
    near = [*_touching(block, at), *(cells for k, cells in block if k > at)]
    words = max(near, key=_said, default=[""] * width)
    groups = _spread_out(words) if _said(words) > 1 else [""] * width
    return at, [u if u == "-" or not is_empty(u) else "" for u in units], groups


def begin(rows: Sequence[list[str]], widths: Sequence[int]) -> int | None:
    """The first of the rows that is data, None: none is.

    Settings over a table may look like readings: they are a few rows, and another header stands below them.
    """
    like = [len(cells) in widths and is_data(cells) for cells in rows]
    starts = [k for k, one in enumerate(like) if one and not (k and like[k - 1])]
    for k, after in zip(starts, [*starts, len(rows)][1:], strict=True):
        length = like.index(False, k) - k if False in like[k:] else len(rows) - k
        headers = [cells for cells in rows[k + length : after] if _is_header(cells)]
        if length >= _A_RUN or after == len(rows) or all(cells in rows[:k] for cells in headers):
            return k
    return None


def _is_header(cells: Sequence[str]) -> bool:
    """Whether a row holds words alone, and more than one."""
    known = [cell for cell in cells if cell]
    return len(known) > 1 and all(holds_word(cell) and not is_stamp(cell) for cell in known)


def _touching(rows: Sequence[tuple[int, list[str]]], at: int) -> Iterator[list[str]]:
    """The rows directly above the one at a place, without a gap."""
    for k, cells in [one for one in rows if one[0] < at][::-1]:
        at -= 1
        if k != at:
            return
        yield cells


def _said(cells: Sequence[str]) -> int:
    """How many different words a row has: names differ, settings are often the same."""
    return len({cell for cell in cells if holds_word(cell) and not is_stamp(cell)})


def _without_labels(cells: list[str]) -> list[str]:
    """A row without the word that stands before each of its values: Unit, degC, Unit, um."""
    labels = set(cells[::2])
    paired = len(cells) > 3 and len(cells) % 2 == 0 and len(labels) == 1 and labels != {""}
    return [cell if k % 2 else "" for k, cell in enumerate(cells)] if paired else cells


def fitted(cells: list[str], width: int) -> list[str] | None:
    """A line of names or units with as many cells as there are columns, or None. Marks before or behind the
    names make empty cells: these name nothing.
    """
    if len(cells) == width:
        return cells
    if len(cells) > width and len(names := [cell for cell in cells if cell]) == width:
        return names
    return cells[:width] if len(cells) == width + 1 and not cells[-1] else None


def _units(cells: Sequence[str]) -> float:
    """Share of the cells of a row that are units; one that only a list of all units has counts half: t, P.

    A number is the unit of a ratio, or a setting: it counts for neither.
    """
    known = [cell.strip("[]()") for cell in cells if cell and not is_number(cell)]
    usual = sum(bool(known_unit(cell) or time_unit(cell) or steps_in(cell)) for cell in known)
    any_unit = sum(is_unit(cell) or bool(time_unit(cell) or steps_in(cell)) for cell in known)
    return (usual + any_unit) / 2 / max(1, len(known))


def _spread_out(cells: Sequence[str]) -> list[str]:
    """Repeat a word over a group of columns. The file has it only over the first of them."""
    found: list[str] = []
    for cell in cells:
        found.append(cell or (found[-1] if found else ""))
    return found


def explained(name: str, above: Sequence[Row]) -> str:
    """What a list of channels over the table says of a name such as CH1, or ""."""
    rows = [
        cells for _, cells in above if cells and cells[0].casefold() == name.casefold() and len(cells) > 1
    ]
    return next((cell for row in rows for cell in row[1:2] if holds_word(cell)), "")


def _compare(path: Path, above: Sequence[Row], width: int) -> None:
    """Raise a UserError if the line above the rows is a header with too many or too few names."""
    line, names = above[-1] if above else (0, [])
    if len(names) > 1 and all(holds_word(name) for name in names):
        raise UserError(
            f"{path}, line {line}: the header has {len(names)} names, the rows {width} cells; "
            f"{'add the missing names' if len(names) < width else 'a name too many or a column is missing'}"
        )


def is_data(cells: Sequence[str]) -> bool:
    """More numbers, stamps and switches than words; a header or a row of units has none.

    Words for "not measured" count for neither: a logger often has nothing yet in its first row.
    """
    known = [cell for cell in cells if not is_empty(cell)]
    readable = [c for c in known if is_number(c) or is_stamp(c) or is_switch(c)]
    return len(readable) > len(known) / 2
