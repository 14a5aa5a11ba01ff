"""Errors whose probe was not set to zero: counted from their first reading."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from discovery.firsthour.guess import Guess
from discovery.firsthour.measures import DEGREES
from discovery.firsthour.recorded import Recorded
from discovery.firsthour.table import Array, OwnTable
from discovery.recordings.campaignfile import CampaignForm
from discovery.recordings.oddvalues import first_reading
from discovery.recordings.units import conversion

_FAR = 3.0  # times the span: no thermal error starts so far from zero
_AT_ZERO, _PERHAPS = 0.03, 0.3  # of the largest span: at zero; so far apart that the zero may be another
_WARMER = 1.0  # K: a machine that starts so much warmer has moved
_APART = 2.0  # times the largest span: nor do recordings with one zero start so far from each other

Zeros = dict[str, dict[str, float]]  # by recording and error: what its readings are counted from


def from_first_readings(found: Recorded, guesses: Mapping[str, Guess]) -> tuple[Recorded, dict[str, float]]:
    """The recordings with errors counted from their first reading, where the zero of a probe is arbitrary.

    That is so if it starts in any recording further from zero than it then moves, several times over, or if
    recordings start so far from each other. All recordings are treated alike. Parts of one file keep the zero
    of that file.

    Returns:
        The recordings, and the spread that each of these errors has in the campaign file.
    """
    errors = [name for name, one in guesses.items() if one.role == "error"]
    read = {name: {error: _values(run, error) for error in errors} for name, run in found.recordings.items()}
    files = {name: (run.path, run.name) for name, run in found.recordings.items()}
    zeros = _zeros(read, files)

    def counted(run: OwnTable, zero: Mapping[str, float]) -> OwnTable:
        return replace(
            run, columns=tuple(replace(c, values=c.values - zero.get(c.name, 0.0)) for c in run.columns)
        )

    moved = {name: counted(run, zeros[name]) for name, run in found.recordings.items()}
    counted_from = replace(found, recordings=moved, notes=(*found.notes, *_notes(zeros)))
    return counted_from, _spreads(read, zeros, files)


def perhaps_own_zeros(
    found: Recorded, guesses: Mapping[str, Guess], known: Mapping[str, float]
) -> dict[str, float]:
    """Errors whose probe may have been set to zero before each recording, with the spread of each: they all
    start at zero although temperatures differ there, or they start apart. Only a fit can tell.

    Args:
        known: errors with a zero of their own already.
    """
    runs = list(found.recordings.values())[:-1]
    if len({(run.path, run.name) for run in runs}) < 2:
        return {}
    warmer = _warmer(runs, guesses) > _WARMER
    spreads = {}
    for error in (name for name, one in guesses.items() if one.role == "error" and name not in known):
        read = [one for run in runs if (one := _known(_values(run, error))).size]
        most = max((float(np.ptp(one)) for one in read), default=0.0)
        firsts = np.array([first_reading(one) for one in read])
        at_zero = warmer and np.abs(firsts).max(initial=0.0) <= _AT_ZERO * most
        if most > 0.0 and (at_zero or np.ptp(firsts) > _PERHAPS * most):
            moved = np.concatenate([one - first for one, first in zip(read, firsts, strict=True)])
            spreads[error] = float(f"{np.sqrt(np.mean(moved**2)):.2g}")
    return spreads


def _warmer(runs: Sequence[OwnTable], guesses: Mapping[str, Guess]) -> float:
    """How far a temperature starts apart between recordings [K], at most."""
    apart = [0.0]
    for name, one in guesses.items():
        if one.unit in DEGREES:
            known = [values for run in runs if (values := _known(_values(run, name))).size]
            firsts = [first_reading(values) for values in known] or [0.0]
            apart.append(float(np.ptp(firsts)) * conversion(one.unit, "temperature").factor)
    return max(apart)


def again_from_first_readings(
    folder: Path, campaign: CampaignForm, names: Sequence[str]
) -> tuple[dict[str, str], list[str]]:
    """The same for the recordings of a folder, after a person said in its campaign file what is an error.

    Args:
        names: recordings of the campaign, the last one held out.

    Returns:
        Texts of the CSV files that change, by file, and lines about them, with what the campaign file lacks.
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
    files = {name: entries[name].note for name in frames}
    zeros = _zeros(read, files)
    lacking = [
        f"write spread = {sd:g} into the line of '{error}' in campaign.toml: fits then find the rest of each "
        "zero"
        for error, sd in _spreads(read, zeros, files).items()
        if campaign.channels[error].spread is None
    ]
    texts = {}
    for name, zero in zeros.items():
        frame = frames[name]
        for error, first in zero.items():
            counted = read[name][error] - first
            frame[error] = ["" if np.isnan(one) else f"{one:.10g}" for one in counted]
        if zero:
            texts[entries[name].file] = frame.to_csv(index=False, lineterminator="\n")
    return texts, [*_notes(zeros), *lacking]


def _zeros(read: Mapping[str, Mapping[str, Array]], files: Mapping[str, Hashable]) -> Zeros:
    """The first readings of all errors that start far from zero, or far from where they start elsewhere, in a
    recording of the fit.

    Args:
        read: readings by recording (the last one is held out) and error. files: of which file each recording
            is a part.
    """
    shifted = dict.fromkeys(
        error
        for errors in list(read.values())[:-1]
        for error, values in errors.items()
        if _far(values) or _apart([one.get(error, np.empty(0)) for one in list(read.values())[:-1]])
    )
    first: dict[tuple[Hashable, str], float] = {}  # the first part of a file comes first
    zeros: Zeros = {name: {} for name in read}
    for name, errors in read.items():
        for error in shifted:
            known = _known(errors.get(error, np.empty(0)))
            if known.size:
                first.setdefault((files[name], error), first_reading(known))
            if (files[name], error) in first:
                zeros[name][error] = first[files[name], error]
    return zeros


def _spreads(
    read: Mapping[str, Mapping[str, Array]], zeros: Zeros, files: Mapping[str, Hashable]
) -> dict[str, float]:
    """How far each of these errors may have come by its first reading: as far as it usually is from there.

    None where all recordings are parts of one file: they have one zero.
    """
    if len(set(files.values())) < 2:
        return {}
    seen = list(zeros)[:-1]
    found = {}
    for error in dict.fromkeys(error for name in seen for error in zeros[name]):
        moved = [_known(read[name][error]) - zeros[name][error] for name in seen if error in zeros[name]]
        found[error] = float(f"{np.sqrt(np.mean(np.concatenate(moved) ** 2)):.2g}")
    return {error: sd for error, sd in found.items() if sd > 0}


def _notes(zeros: Zeros) -> list[str]:
    notes = []
    for error in dict.fromkeys(error for zero in zeros.values() for error in zero):
        starts = {name: zero[error] for name, zero in zeros.items() if error in zero}
        name = max(starts, key=lambda one: abs(starts[one]))
        notes.append(
            f"'{error}' starts at {starts[name]:g} in {name}, far from zero compared with how much it moves: "
            "in each file it is counted from its first reading. Fits can only estimate what the machine had "
            "moved before: begin all recordings cold, or keep one zero"
        )
    return notes


def _far(values: Array) -> bool:
    known = _known(values)
    return bool(known.size and abs(known[0]) > _FAR * np.ptp(known) > 0.0)


def _apart(recordings: Sequence[Array]) -> bool:
    known = [one for values in recordings if (one := _known(values)).size]
    firsts = [first_reading(one) for one in known]
    return bool(known and np.ptp(firsts) > _APART * max(np.ptp(one) for one in known) > 0.0)


def _known(values: Array) -> Array:
    return values[np.isfinite(values)]


def _values(run: OwnTable, name: str) -> Array:
    return next((column.values for column in run.columns if column.name == name), np.empty(0))
