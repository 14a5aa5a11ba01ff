"""A campaign in memory: channels and recordings in canonical units, the files' oddities left behind."""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.files import dotted, locate, read_text, read_toml
from discovery.recordings.campaignfile import CampaignForm, ChannelForm, RecordingForm, campaign_path
from discovery.recordings.clockcheck import clock_findings
from discovery.recordings.columns import Columns
from discovery.recordings.correction import pair_corrections, uncompensated
from discovery.recordings.longfile import How
from discovery.recordings.oddvalues import first_reading, impossible_readings
from discovery.recordings.reading import read_columns
from discovery.recordings.roles import ROLES, SENSORS, Between, is_input
from discovery.recordings.units import Conversion, UnitError, conversion
from discovery.schema import Named, suggest

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """`unit` is the canonical one, `noise` (standard deviation of a reading) and `spread` are in it.

    `spread`: standard deviation of the unknown constant by which an input, or the zero of an error, is off in
    a recording; 0: known. `factor`: of a value in the file, to make it one in `unit`.
    """

    name: str
    role: str
    unit: str
    noise: float | None
    between: Between
    spread: float = 0.0
    factor: float = 1.0

    @property
    def measured(self) -> bool:
        """Whether this is an output: models predict it and do not use it as an input."""
        return ROLES[self.role].measured

    @property
    def is_input(self) -> bool:
        """Whether models are fed with this."""
        return is_input(self.role)

    @property
    def is_sensor(self) -> bool:
        """Whether this is read from a thermometer or a probe, also one that models are fed with. What is held
        between stamps is set.
        """
        thermometer = self.role == "other input" and self.unit in ("degC", "K") and self.between == "linear"
        return self.role in SENSORS or thermometer


@dataclass(frozen=True)
class Recording:
    """`time` (T,): seconds since the first stamp, increasing. `values`: each (T,), NaN: not measured; errors
    as they were without compensation, whatever correction the machine applied, and those with a zero of their
    own in each recording counted from their first reading.

    `origin`: ISO 8601 instant of time 0 when the file had instants. `start`: seconds of time 0 on the file's
    clock, so that a stamp in the file is start + time. `counts`: of a recording so long that its readings are
    means, how many (T,) each is the mean of, by measured channel.
    """

    name: str
    time: Array
    values: Mapping[str, Array]
    note: str = ""
    origin: str | None = None
    start: float = 0.0
    counts: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Campaign:
    """The recordings of one machine."""

    name: str
    channels: Mapping[str, Channel]
    recordings: Mapping[str, Recording]
    path: Path = field(default=Path())
    simulated: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", Named("channel", self.channels))
        object.__setattr__(self, "recordings", Named("recording", self.recordings))

    def unread(self, recordings: Collection[str], outputs: Collection[str]) -> str:
        """What to say where no recording holds a reading of any of the outputs; empty where one does."""
        values = (self.recordings[r].values.get(y, np.empty(0)) for r in recordings for y in outputs)
        if any(np.isfinite(v).any() for v in values):
            return ""
        return (
            f"no reading of {' or '.join(outputs)} in {', '.join(recordings)}; name recordings that hold some"
        )

    def unread_to_fit(self, recordings: Collection[str], outputs: Collection[str]) -> str:
        """The same where one of them holds no reading: a model cannot be fitted to it."""
        lost = [r for r in recordings if self.unread([r], outputs)]
        return self.unread(lost, outputs) if lost else ""


def load_campaign(path: str | os.PathLike[str], only: Collection[str] | None = None) -> Campaign:
    """Read a campaign file and its recordings.

    Applied corrections are added to the readings of their errors, so the errors are uncompensated.

    Args:
        path: the campaign file, or its folder.
        only: names of the recordings to read; default all.

    Returns:
        The campaign. `channels[name]` has role and unit; `recordings[name]` has `time` (T,) in s and
        `values[channel]` (T,) in canonical units: um, um/m, degC, W, rpm, l/min. NaN: nothing was measured.

    Raises:
        UserError: a mistake in the campaign file, an unknown unit, a missing column, text in a number cell,
            or time that does not increase. The message has file and line.
    """
    path = campaign_path(Path(path))
    form = read_toml(path, CampaignForm)
    conversions = {name: _conversion(path, name, channel) for name, channel in form.channels.items()}
    channels = {name: make_channel(name, one, conversions[name]) for name, one in form.channels.items()}
    pairs, mistakes = pair_corrections(form.channels, {name: to.unit for name, to in conversions.items()})
    for key, what in mistakes:
        raise UserError(f"{path}, line {locate(read_text(path), key)}: {dotted(key)}: {what}")
    for name in only or ():
        if name not in form.recordings:
            raise UserError(f"{path}: no recording '{name}'; {suggest(name, list(form.recordings))}")
    recordings = {
        name: _load(path, name, one, form.channels, conversions, pairs)
        for name, one in form.recordings.items()
        if only is None or name in only
    }
    return Campaign(form.name, channels, recordings, path, form.simulated)


def make_channel(name: str, form: ChannelForm, to: Conversion) -> Channel:
    """A channel in its canonical unit; noise and spread are differences, so they take the factor alone."""
    noise = None if form.noise is None else form.noise * abs(to.factor)
    spread = (form.spread or 0.0) * abs(to.factor)
    between = form.between or ROLES[form.role].between
    return Channel(name, form.role, to.unit, noise, between, spread, to.factor)


def wanted_columns(form: RecordingForm, channels: Mapping[str, ChannelForm]) -> dict[str, str]:
    """Channel to column, of those that are to be read from the file."""
    return {name: one.column or name for name, one in channels.items() if name not in form.set}


def channel_values(
    columns: Columns, form: RecordingForm, channels: Mapping[str, ChannelForm], to: Mapping[str, Conversion]
) -> dict[str, Array]:
    """Each channel that the file or `set` gives, (T,), in its canonical unit."""
    raw = {
        name: columns.values[column]
        for name, column in wanted_columns(form, channels).items()
        if column in columns.values
    }
    raw |= {name: np.full(columns.time.shape, value) for name, value in form.set.items() if name in channels}
    return {
        name: to[name].factor * raw[name] + to[name].offset for name in channels if name in raw and name in to
    }


def how_to_read(
    form: RecordingForm,
    channels: Mapping[str, ChannelForm],
    to: Mapping[str, Conversion],
    pairs: Mapping[str, str],
) -> How:
    """What the columns of a recording's file are, where it is so long that rows become means."""
    wanted = wanted_columns(form, channels)
    made = {c: make_channel(c, channels[c], to[c]) for c in wanted if c in to}
    sensors: dict[str, list[tuple[Channel, float, float]]] = {}
    for name, one in made.items():
        sensors.setdefault(wanted[name], []).append((one, to[name].factor, to[name].offset))
    only_at = {wanted[c]: wanted[error] for c, error in pairs.items() if c in made and error in made}
    held = {wanted[c] for c, one in made.items() if one.between == "held" and not one.measured}
    return How(frozenset(held - only_at.keys()), only_at, sensors)


def _conversion(path: Path, name: str, form: ChannelForm) -> Conversion:
    try:
        return conversion(form.unit, form.role)
    except UnitError as error:
        key = ("channels", name, "unit")
        raise UserError(f"{path}, line {locate(read_text(path), key)}: {dotted(key)}: {error}") from None


def _load(
    path: Path,
    name: str,
    form: RecordingForm,
    channels: Mapping[str, ChannelForm],
    conversions: Mapping[str, Conversion],
    pairs: Mapping[str, str],
) -> Recording:
    file = path.parent / form.file
    wanted = wanted_columns(form, channels)
    unknown = next((channel for channel in form.set if channel not in channels), None)
    if unknown is not None:
        key = ("recordings", name, "set", unknown)
        hint = f"no such channel; {suggest(unknown, list(channels))}"
        raise UserError(f"{path}, line {locate(read_text(path), key)}: {dotted(key)}: {hint}")
    columns, findings = read_columns(
        file, list(wanted.values()), how_to_read(form, channels, conversions, pairs)
    )
    if columns is not None:
        findings = findings + clock_findings(file, columns)
    for finding in findings:
        if finding.severity == "error":
            raise UserError(finding.sentence)
    if columns is None:
        raise UserError(f"{file}: cannot be read; see `discovery check {path}`")
    for channel, column in wanted.items():
        if column not in columns.values:
            do = f"{suggest(column, list(columns.header))}; or say set = {{ {channel} = ... }} in {path}"
            raise UserError(f"{file}, line 1: no column '{column}'; {do}")
    values = channel_values(columns, form, channels, conversions)
    made = {name: make_channel(name, one, conversions[name]) for name, one in channels.items()}
    for channel, series in values.items():
        if columns.counts:  # taken out row by row
            break
        known = np.flatnonzero(np.isfinite(series))
        series[known[impossible_readings(made[channel], series[known])]] = np.nan  # `check` says so
    values = uncompensated(str(file), columns.time, values, channels, pairs)
    for channel, series in values.items():
        known = np.isfinite(series)
        if made[channel].measured and made[channel].spread and known.any():
            values[channel] = series - first_reading(series[known])
    return Recording(
        name,
        columns.time - columns.time[0],
        Named("channel", values),
        form.note,
        columns.origin,
        float(columns.time[0]),
        {c: columns.counts[to] for c, to in wanted.items() if to in columns.counts and made[c].measured},
    )
