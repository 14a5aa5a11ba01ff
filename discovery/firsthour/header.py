"""Where the names of the columns stand, the units next to them, and what explains a name further up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.firsthour.cells import holds_word, is_empty, is_number, is_stamp, is_switch
from discovery.firsthour.measures import known_unit, time_unit, unit_in

Row = tuple[int, list[str]]
"""Number of the line, and its cells."""


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
    rows = [(k, _fitted(head[k][1], width)) for k in range(end)]
    full = [(k, cells) for k, cells in rows if cells is not None]
    if not full:
        _compare(path, head[:end], width)
        raise UserError(
            f"{path}: no header above the rows of {width} cells; write {width} names, starting with time"
        )
    if first is None:  # nothing can be read as data: the fullest row is the header
        at = max(full, key=lambda one: (sum(map(bool, one[1])), -one[0]))[0]
        return at, [""] * width, [""] * width
    units = [""] * width
    at, names = full[-1]
    others = [one for one in full[:-1] if one[0] >= at - 3]
    if others and _are_units(names):
        units, (at, names) = names, others[-1]
        others = others[:-1]
    elif others and _are_units(others[-1][1]):
        units, others = others[-1][1], others[:-1]
    above = others[-1][1] if others and others[-1][0] == at - 1 else [""] * width
    groups = _spread_out(above) if sum(map(bool, above)) > 1 else [""] * width
    return at, [u if u == "-" or not is_empty(u) else "" for u in units], groups


def _fitted(cells: list[str], width: int) -> list[str] | None:
    """A line of names or units with as many cells as there are columns, or None."""
    if len(cells) == width:
        return cells
    return cells[:width] if len(cells) == width + 1 and not cells[-1] else None


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a row holds units: most of its cells are units or a "-"."""
    known = [cell for cell in cells if cell]
    named = [known_unit(cell) or time_unit(cell) or unit_in(f"x [{cell.strip('[]()')}]") for cell in known]
    return sum(map(bool, named)) >= max(1, len(known) / 2)


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
