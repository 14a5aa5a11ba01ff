"""What a file of a recording holds, before roles and units: columns of numbers and their lines."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Lines = NDArray[np.int64]

TIME = "time"
FEW = 20  # readings of a channel: fewer carry no model
EMPTY_CELLS = ("", "nan", "NaN", "NAN", "NA", "N/A", "#N/A", "null", "NULL", "None", "-")  # not measured


@dataclass(frozen=True)
class Columns:
    """`header`: all names in the file. `time` (T,): seconds on the file's clock, in the order of the file.

    `values`: the wanted columns, each (T,), NaN where not measured. `lines` (T,): where each row stands.
    `origin`: the instant at which `time` is 0, when the file has instants. Of a long file that was reduced to
    means: `counts`, readings (T,) in each mean by column; `rows` of the file; `left_out`, by column, lone
    readings that only a fault explains. `repeated`: rows that were left out because they repeat one before.
    """

    header: tuple[str, ...]
    time: Array
    values: Mapping[str, Array]
    lines: Lines
    origin: str | None = None
    counts: Mapping[str, Array] = field(default_factory=dict)
    rows: int = 0
    left_out: Mapping[str, int] = field(default_factory=dict)
    repeated: int = 0

    @property
    def runs_forward(self) -> bool:
        return bool(self.time.size and np.isfinite(self.time).all() and (np.diff(self.time) > 0).all())

    @property
    def is_finite(self) -> bool:
        return not any(np.isinf(column).any() for column in self.values.values())
