"""Recordings of a machine that was compensated meanwhile: what the controller took off is added again.

    uncompensated error = reading + applied correction

A fit to readings on a compensated machine would learn what the compensation left, and a second compensation
would undo the first.
"""

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.files import Key
from discovery.recordings.campaignfile import ChannelForm
from discovery.recordings.roles import CORRECTION, ROLES, Between
from discovery.schema import suggest

Array = NDArray[np.float64]


def pair_corrections(
    channels: Mapping[str, ChannelForm], units: Mapping[str, str]
) -> tuple[dict[str, str], list[tuple[Key, str]]]:
    """Which error each applied correction belongs to, and what is wrong: keys and sentences.

    Args:
        units: canonical unit of each channel; one that is not there is not looked at.
    """
    errors = [name for name, one in channels.items() if one.role == "error"]
    corrections = [name for name, one in channels.items() if one.role == CORRECTION and name in units]
    pairs: dict[str, str] = {}
    mistakes: list[tuple[Key, str]] = []
    for name in corrections:
        given = channels[name].corrects
        error = given or corrected_by_name(name, errors, only=len(corrections) == 1)
        key: Key = ("channels", name, "corrects") if given else ("channels", name)
        what = _mistake(name, error, errors, pairs.values(), units)
        if what is not None:
            mistakes.append((key, what))
        elif error is not None:
            pairs[name] = error
    return pairs, mistakes


def _mistake(
    name: str, error: str | None, errors: list[str], taken: Collection[str], units: Mapping[str, str]
) -> str | None:
    if error is None:
        known = ", ".join(errors) or "there is none"
        return f'the error that it corrects is not given; write corrects = "NAME" of an error ({known})'
    if error not in errors:
        return f"'{error}' is not a channel of role error; {suggest(error, errors)}"
    if error in taken:
        return f"'{error}' has two corrections; add them up in one column"
    if error in units and units[error] != units[name]:
        return f"a correction in {units[name]} cannot belong to '{error}' in {units[error]}; mend its unit"
    return None


def corrected_by_name(correction: str, errors: Sequence[str], *, only: bool) -> str | None:
    """The error whose name stands in that of the correction; where both are the only ones, that one.

    >>> corrected_by_name("corr_E_Y0C", ["E_Y0C", "E_Z0T"], only=False)
    'E_Y0C'
    """
    named = [e for e in errors if re.search(rf"(?<![^\W_]){e}(?![^\W_])", correction, re.IGNORECASE)]
    if named:
        return max(named, key=len)
    return errors[0] if only and len(errors) == 1 else None


def uncompensated(
    where: str,
    time: Array,
    values: Mapping[str, Array],
    channels: Mapping[str, ChannelForm],
    pairs: Mapping[str, str],
) -> dict[str, Array]:
    """The values of a recording with each error as it were without compensation.

    A reading before the first known correction is left out: nobody knows what it lacks.

    Args:
        where: what the message of an error begins with.
        time: (T,) s. values: each (T,), in canonical units, NaN where not measured.
        pairs: correction -> error.

    Raises:
        UserError: a correction that is known nowhere.
    """
    found = dict(values)
    for name, error in pairs.items():
        if name not in values or error not in values:
            continue
        if not np.isfinite(values[name]).any():
            do = f"record it, or say set = {{ {name} = 0 }} if the machine was not compensated"
            raise UserError(f"{where}: the applied correction '{name}' has no value; {do}")
        form = channels[name]
        applied = at_every_row(time, values[name], form.between or ROLES[CORRECTION].between)
        found[error] = values[error] + form.sign * applied
    return found


def at_every_row(time: Array, values: Array, between: Between) -> Array:
    """A channel (T,) at every row, held or straight between its values; NaN before the first one.

    >>> import numpy as np
    >>> at_every_row(np.arange(4.0), np.array([np.nan, 1.0, np.nan, 3.0]), "held").tolist()
    [nan, 1.0, 1.0, 3.0]
    """
    known = np.flatnonzero(np.isfinite(values))
    if between == "linear":
        full = np.interp(time, time[known], values[known])
    else:
        full = values[known[np.maximum(np.searchsorted(known, np.arange(len(time)), side="right") - 1, 0)]]
    return np.where(np.arange(len(time)) < known[0], np.nan, full)
