"""Applied corrections: are they known where the error was read, and is their size one of a correction."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from discovery.recordings.columns import Array, Columns
from discovery.recordings.finding import Finding, more
from discovery.recordings.inputcheck import inside, long_gaps

_LEAST = 0.1  # um, um/m: no controller corrects in finer steps


def correction_findings(
    file: Path, columns: Columns, values: Mapping[str, Array], pairs: Mapping[str, str]
) -> Iterator[Finding]:
    """A correction that is known nowhere (an error), or not where its error was read, or too small to be one.

    Args:
        values: each (T,), in canonical units, errors as they were read.
        pairs: correction -> error.
    """
    for name, error in pairs.items():
        if name in values and error in values:
            yield from _findings(file, columns, name, error, values)


def _findings(
    file: Path, columns: Columns, name: str, error: str, values: Mapping[str, Array]
) -> Iterator[Finding]:
    known, read = np.isfinite(values[name]), np.isfinite(values[error])
    if not known.any():
        do = f"record it, or say set = {{ {name} = 0 }} if the machine was not compensated"
        yield Finding("error", file, None, f"the applied correction '{name}' has no value at all", do)
        return
    first = int(np.argmax(known))
    early = np.flatnonzero(read[:first])
    if early.size:
        what = f"'{error}' is read before its correction '{name}' is known{more(early.size)}"
        do = "such readings are left out; record the correction from the start"
        yield Finding("warning", file, int(columns.lines[early[0]]), what, do)
    gaps = [gap for gap in long_gaps(columns.time, known) if gap[0] > first]
    alone = np.flatnonzero(inside(gaps, known.size) & read)
    if alone.size:
        what = (
            f"'{error}' has readings long after the last value of its correction '{name}'{more(alone.size)}"
        )
        do = "the correction before is taken; fill it in, or empty these readings"
        yield Finding("warning", file, int(columns.lines[alone[0]]), what, do)
    largest = float(np.max(np.abs(values[name][known])))
    if 0.0 < largest < _LEAST:
        what = f"the applied correction '{name}' is never more than {largest:.2g}"
        do = "no controller corrects so little: look at its unit"
        yield Finding("warning", file, int(columns.lines[first]), what, do)
