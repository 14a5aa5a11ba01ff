"""One thing that is wrong with a campaign, as a person wants to read it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class Finding:
    """`error`: the recording cannot be used as it is; `warning`: it can, but somebody should look."""

    severity: Literal["error", "warning"]
    file: Path
    line: int | None  # from 1; the number of the row in a Parquet file; None: the file as a whole
    what: str
    do: str

    @property
    def where(self) -> str:
        """The file and the line, as ``fit.csv, line 7``.

        >>> Finding("error", Path("fit.parquet"), 3, "x", "y").where
        'fit.parquet, row 3'
        """
        if self.line is None:
            return str(self.file)
        return f"{self.file}, {'row' if self.file.suffix == '.parquet' else 'line'} {self.line}"

    @property
    def sentence(self) -> str:
        return f"{self.where}: {self.what}; {self.do}"

    def __str__(self) -> str:
        return f"{self.severity}: {self.sentence}"


def more(count: int) -> str:
    """What is added to the first of `count` findings of one kind.

    >>> more(1), more(3)
    ('', ' (and 2 more like it)')
    """
    return f" (and {count - 1} more like it)" if count > 1 else ""
