"""One thing that is wrong with a campaign, as a person wants to read it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Severity = Literal["error", "warning"]
_NAMED = 4  # files that a folded line names


@dataclass(frozen=True)
class Finding:
    """`error`: the recording cannot be used; `warning`: it can, but somebody should look."""

    severity: Severity
    file: Path
    line: int | None  # from 1; the number of the row in a Parquet file; None: the file as a whole
    what: str
    do: str
    kind: str = ""  # findings of one kind are folded into one line
    channel: str = ""
    weight: float = 1.0  # how much it matters, the larger the worse

    @property
    def where(self) -> str:
        """The file and the line, as ``fit.csv, line 7``.

        >>> Finding("error", Path("fit.parquet"), 3, "x", "y").where
        'fit.parquet, row 3'
        """
        if self.line is None:
            return str(self.file)
        return f"{self.file}, {line_of(self.file, self.line)}"

    @property
    def sentence(self) -> str:
        return f"{self.where}: {self.what}; {self.do}"

    def __str__(self) -> str:
        return f"{self.severity}: {self.sentence}"


def line_of(file: Path, line: int) -> str:
    """Where a row stands in a file, in words."""
    return f"{'row' if file.suffix == '.parquet' else 'line'} {line}"


def more(count: int) -> str:
    """What is added to the first of `count` findings of one kind.

    >>> more(1), more(3)
    ('', ' (and 2 more like it)')
    """
    return f" (and {count - 1} more like it)" if count > 1 else ""


def worst_first(findings: Sequence[Finding]) -> list[Finding]:
    """Errors, then warnings; of each the weightiest first."""
    return sorted(findings, key=lambda one: (one.severity != "error", -one.weight))


def folded(findings: Sequence[Finding]) -> list[str]:
    """A line for each finding, worst first; of a kind that comes again and again one line for all.

    >>> from dataclasses import replace
    >>> what = "the column 'x' is not a channel"
    >>> one = Finding("warning", Path("a.csv"), 1, what, "declare it", "stray", "x")
    >>> folded([one, replace(one, file=Path("b.csv")), replace(one, channel="y")])
    ["warning: a.csv, line 1: the column 'x' is not a channel; declare it (the same of y; also in b.csv)"]
    """
    groups: dict[tuple[object, ...], list[Finding]] = {}
    for k, one in enumerate(worst_first(findings)):
        key = (one.severity, one.kind, one.do) if one.kind else (k,)
        groups.setdefault(key, []).append(one)
    return [_line(group) for group in groups.values()]


def _line(group: Sequence[Finding]) -> str:
    first = group[0]
    channels = list(
        dict.fromkeys(one.channel for one in group if one.channel and one.channel != first.channel)
    )
    files = list(dict.fromkeys(one.file.name for one in group if one.file != first.file))
    notes = []
    if channels:
        notes.append(f"the same of {_listed(channels)}")
    if files:
        notes.append(f"also in {_listed(files)}")
    if len(group) > 1 and not notes:
        notes.append(f"{len(group) - 1} more like it")
    more_of_it = "; ".join(notes)
    return f"{first} ({more_of_it})" if notes else str(first)


def _listed(names: Sequence[str]) -> str:
    rest = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {rest} more" if rest > 0 else "")
