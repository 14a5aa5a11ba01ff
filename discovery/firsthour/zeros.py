"""Errors whose probe was not set to zero: counted from their first reading."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from discovery.firsthour.guess import Guess
from discovery.firsthour.recorded import Recorded
from discovery.firsthour.table import Array, OwnTable
from discovery.recordings.campaignfile import CampaignForm
from discovery.recordings.oddvalues import far_step

_AFTER = 7  # readings that a first one is compared with
_FAR = 3.0  # times the span: no thermal error starts so far from zero

Zeros = dict[str, dict[str, float]]  # by recording and error: what its readings are counted from


def from_first_readings(found: Recorded, guesses: Mapping[str, Guess]) -> Recorded:
    """The recordings with errors counted from their first reading, where the zero of a probe is arbitrary.

    That is so if it starts in any recording further from zero than it then moves, several times over. All
    recordings are treated alike. Parts of one file keep the zero of that file.
    """
    errors = [name for name, one in guesses.items() if one.role == "error"]
    read = {name: {error: _values(run, error) for error in errors} for name, run in found.recordings.items()}
    zeros = _zeros(read, {name: (run.path, run.name) for name, run in found.recordings.items()})

    def counted(run: OwnTable, zero: Mapping[str, float]) -> OwnTable:
        return replace(
            run, columns=tuple(replace(c, values=c.values - zero.get(c.name, 0.0)) for c in run.columns)
        )

    moved = {name: counted(run, zeros[name]) for name, run in found.recordings.items()}
    return replace(found, recordings=moved, notes=(*found.notes, *_notes(zeros)))


def again_from_first_readings(
    folder: Path, campaign: CampaignForm, names: Sequence[str]
) -> tuple[dict[str, str], list[str]]:
    """The same for the recordings of a folder, after a person said in its campaign file what is an error.

    Args:
        names: recordings of the campaign, the last one held out.

    Returns:
        Texts of the CSV files that change, by file, and lines about them.
    """
    import pandas as pd

    errors = [name for name, one in campaign.channels.items() if one.role == "error"]
    entries = {name: campaign.recordings[name] for name in names}
    frames = {
        name: pd.read_csv(folder / entry.file, dtype=str, keep_default_na=False)
        for name, entry in entries.items()
        if Path(entry.file).suffix == ".csv" and (folder / entry.file).is_file()
    }
    read = {
        name: {e: pd.to_numeric(frame[e], errors="coerce").to_numpy(float) for e in errors if e in frame}
        for name, frame in frames.items()
    }
    zeros = _zeros(read, {name: entries[name].note for name in frames})
    texts = {}
    for name, zero in zeros.items():
        frame = frames[name]
        for error, first in zero.items():
            counted = read[name][error] - first
            frame[error] = ["" if np.isnan(one) else f"{one:.10g}" for one in counted]
        if zero:
            texts[entries[name].file] = frame.to_csv(index=False, lineterminator="\n")
    return texts, _notes(zeros)


def _zeros(read: Mapping[str, Mapping[str, Array]], files: Mapping[str, Hashable]) -> Zeros:
    """The first readings of all errors of which one starts far from zero in a recording of the fit.

    Args:
        read: readings by recording (the last one is held out) and error. files: of which file each recording
            is a part.
    """
    shifted = dict.fromkeys(
        error for errors in list(read.values())[:-1] for error, values in errors.items() if _far(values)
    )
    first: dict[tuple[Hashable, str], float] = {}  # the first part of a file comes first
    zeros: Zeros = {name: {} for name in read}
    for name, errors in read.items():
        for error in shifted:
            known = _known(errors.get(error, np.empty(0)))
            if known.size:
                first.setdefault((files[name], error), _first(known))
            if (files[name], error) in first:
                zeros[name][error] = first[files[name], error]
    return zeros


def _notes(zeros: Zeros) -> list[str]:
    notes: dict[str, str] = {}
    for name, zero in zeros.items():
        for error, first in zero.items():
            notes.setdefault(
                error,
                f"'{error}' starts at {first:g} in {name}, far from zero compared with how much it moves: in "
                "each file it is counted from its first reading. What the machine had moved before is "
                "unknown: begin all recordings cold, or keep one zero",
            )
    return list(notes.values())


def _far(values: Array) -> bool:
    known = _known(values)
    return bool(known.size and abs(known[0]) > _FAR * np.ptp(known) > 0.0)


def _first(known: Array) -> float:
    """The first of the readings (N,) that those after it do not contradict."""
    near = np.abs(known - np.median(known[:_AFTER])) <= far_step(np.diff(known))
    return float(known[np.argmax(near)])


def _known(values: Array) -> Array:
    return values[np.isfinite(values)]


def _values(run: OwnTable, name: str) -> Array:
    return next((column.values for column in run.columns if column.name == name), np.empty(0))
