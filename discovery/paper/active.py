"""Active compensation: the exported model in the loop with a machine, figures 6 to 9 of the paper.

The runtime reads the machine's log tick by tick, as on a controller, and its offsets move the axes in steps
of their resolution. What the R-Test then reads on the compensated machine is the error plus the offset:
offsets of a few micrometres change no temperature, so a recording of the uncompensated machine gives both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.recordings.campaignfile import ChannelForm
from discovery.recordings.correction import uncompensated
from discovery.recordings.roles import CORRECTION
from discovery.runtime.compensator import Compensator, Settings, State
from discovery.runtime.guards import Reading

Array = NDArray[np.float64]

AXIS_UM = 1.0  # controllable resolution of a linear axis, section 3 of the paper
LEVER_M = 0.25  # a tilt is corrected by a linear axis at the rim of the table: steps of 1 um there


@dataclass(frozen=True)
class Active:
    """A recording replayed with active compensation; `time` (N,) in s.

    `measured[error]` (N,): on the compensated machine, NaN where not read. `applied[error]` (N,): correction
    that the controller took off. `reconstructed[error]` (N,): the uncompensated error, from these two alone.
    `ready` (N,): the runtime was in state ACTIVE; before, it was just switched on and its start still counts.
    `remarks`: what the runtime asks somebody to see to, each once.
    """

    time: Array
    measured: Mapping[str, Array]
    applied: Mapping[str, Array]
    reconstructed: Mapping[str, Array]
    ready: NDArray[np.bool_]
    remarks: tuple[str, ...] = ()

    def compensated(self, error: str) -> Array:
        """What was measured while the runtime was ready, NaN elsewhere."""
        return np.where(self.ready, self.measured[error], np.nan)

    def uncompensated(self, error: str) -> Array:
        """What would have been measured meanwhile."""
        return np.where(self.ready, self.reconstructed[error], np.nan)


def exported_of(
    model: Model, campaign: Campaign, recordings: Sequence[str], step_s: float = 60.0
) -> Exported:
    """The model as a controller has it: written as a sealed document and read back.

    Args:
        recordings: those of the fit; ranges and limits come from them alone.
    """
    data = render(make_document(model, campaign, recordings, step_s))
    document, seal = open_seal(data, model.name)
    return from_document(document, seal, model.name)


def resolution(unit: str) -> float:
    """Step of a correction in the unit of its error: 1 um, or 4 um/m for a tilt corrected at the table's rim.

    >>> resolution("um"), resolution("um/m")
    (1.0, 4.0)
    """
    return AXIS_UM if unit == "um" else AXIS_UM / LEVER_M


def in_steps(offset: float, step: float) -> float:
    """An offset as an axis can go to it.

    >>> in_steps(2.4, 1.0), in_steps(-7.0, 4.0)
    (2.0, -8.0)
    """
    return float(np.round(offset / step) * step)


def compensate(exported: Exported, campaign: Campaign, recording: str) -> Active:
    """Go through a recording tick by tick with a model that knows no more than a controller would."""
    data = campaign.recordings[recording]
    names = [one.name for one in exported.inputs]
    logged = np.any([np.isfinite(data.values[name]) for name in names], axis=0)
    compensator = Compensator(exported, Settings(tick_s=float(np.median(np.diff(data.time[logged])))))
    errors = [name for name in compensator.names if name in data.values]
    step = {name: resolution(campaign.channels[name].unit) for name in errors}
    applied = {name: np.zeros(len(data.time)) for name in errors}
    readings: dict[str, Reading] = {}
    ready = np.zeros(len(data.time), dtype=bool)
    active = False
    remarks: dict[str, None] = {}
    offsets = dict.fromkeys(errors, 0.0)
    columns = {name: data.values[name] for name in names}
    for k, now in enumerate(data.time.tolist()):
        fresh = {n: Reading(float(c[k]), now) for n, c in columns.items() if np.isfinite(c[k])}
        if fresh:
            readings |= fresh
            tick = compensator.tick(readings, now)
            active = tick.state is State.ACTIVE
            remarks |= {f"{e.what}: {e.cause}; {e.remedy}": None for e in tick.events if e.remedy}
            offsets = {name: in_steps(tick.offsets[name], step[name]) for name in errors}
        ready[k] = active
        for name in errors:
            applied[name][k] = -offsets[name]
    measured = {name: np.asarray(data.values[name] - applied[name]) for name in errors}
    found = _reconstructed(campaign, recording, data.time, measured, applied)
    return Active(data.time, measured, applied, found, ready, tuple(remarks))


def _reconstructed(
    campaign: Campaign, where: str, time: Array, measured: Mapping[str, Array], applied: Mapping[str, Array]
) -> dict[str, Array]:
    """Uncompensated errors as loading a recording of the compensated machine gives them."""
    pairs = {f"{name}_applied": name for name in measured}
    channels = {
        channel: ChannelForm(role=CORRECTION, unit=campaign.channels[error].unit, corrects=error)
        for channel, error in pairs.items()
    }
    values = {**measured, **{channel: applied[error] for channel, error in pairs.items()}}
    found = uncompensated(where, time, values, channels, pairs)
    return {name: found[name] for name in measured}
