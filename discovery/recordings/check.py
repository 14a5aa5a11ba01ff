"""Everything that is wrong with a campaign: the campaign file first, then recording by recording."""

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from discovery.files import Key, check_kind, dotted, locate, parse_toml, read_file
from discovery.recordings.campaign import Channel, channel_values, how_to_read, make_channel, wanted_columns
from discovery.recordings.campaignfile import CampaignForm, RecordingForm, campaign_path
from discovery.recordings.clockcheck import clock_findings
from discovery.recordings.columns import TIME, Array, Columns
from discovery.recordings.compare import Seen, compare
from discovery.recordings.correction import pair_corrections
from discovery.recordings.correctioncheck import correction_findings
from discovery.recordings.finding import Finding
from discovery.recordings.inputcheck import input_findings, written_on_change
from discovery.recordings.oddvalues import odd_findings, odd_readings
from discovery.recordings.reading import read_columns
from discovery.recordings.twins import fingerprint
from discovery.recordings.units import Conversion, UnitError, conversion
from discovery.recordings.valuecheck import (
    few_findings,
    frozen_findings,
    load_findings,
    range_findings,
    said_once,
    small_findings,
)
from discovery.schema import sentences, suggest


def check_campaign(path: str | os.PathLike[str], only: Collection[str] | None = None) -> list[Finding]:
    """All findings about the campaign at `path` (the file or its folder), in the order of the files; what
    compares them last. With `only`, of those recordings.

    Raises UserError when the campaign file itself is missing, no text, no TOML, or of another kind.
    """
    path = campaign_path(Path(path))
    text = read_file(path)
    data = parse_toml(text, path)
    check_kind(path, data, CampaignForm)
    form, findings = _form(path, text, data)
    if form is None:
        return findings
    conversions = {}
    for name, channel in form.channels.items():
        try:
            conversions[name] = conversion(channel.unit, channel.role)
        except UnitError as error:
            findings.append(_in_campaign(path, text, ("channels", name, "unit"), str(error)))
    pairs, wrong = pair_corrections(form.channels, {name: to.unit for name, to in conversions.items()})
    findings.extend(_in_campaign(path, text, key, what) for key, what in wrong)
    seen: dict[str, str] = {}
    whole: list[Seen] = []
    checked = sum(only is None or name in only for name in form.recordings)
    for name, recording in form.recordings.items():
        if only is not None and name not in only:
            continue
        for constant in recording.set:
            if constant not in data["channels"]:
                what = f"no such channel; {suggest(constant, list(form.channels))}"
                findings.append(_in_campaign(path, text, ("recordings", name, "set", constant), what))
        found, readings, one = _recording_findings(path, form, name, conversions, pairs)
        findings.extend(found)
        twin = seen.setdefault(readings, name) if readings is not None else name
        if one is not None and twin == name:
            whole.append(one)
        if twin != name:
            line = locate(text, ("recordings", name))
            what = f"recordings.{name} holds the same readings as {twin}"
            findings.append(
                Finding("warning", path, line, what, "name another file, or take one of them out", weight=5.0)
            )
    channels = {name: make_channel(name, form.channels[name], to) for name, to in conversions.items()}
    findings.extend(compare(path, whole, channels))
    return said_once(findings, path, checked)


def summary(findings: Sequence[Finding], misfits: Sequence[str] = ()) -> str:
    """One line about all findings, and about the places where models do not fit the campaign."""
    errors = sum(finding.severity == "error" for finding in findings)
    warnings = len(findings) - errors + len(misfits)
    if not findings and not misfits:
        return "nothing is wrong with these recordings"
    return f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"


def _form(path: Path, text: str, data: dict[str, Any]) -> tuple[CampaignForm | None, list[Finding]]:
    """Return the campaign without its faulty channels and recordings, and the faults. None: too little
    remains.
    """
    try:
        return CampaignForm.model_validate(data), []
    except ValidationError as error:
        mistakes = sentences(CampaignForm, data, error)
    findings = [_in_campaign(path, text, key, what) for key, what in mistakes]
    try:
        return CampaignForm.model_validate(_without(data, [key for key, _ in mistakes])), findings
    except ValidationError:
        return None, findings


def _without(data: dict[str, Any], keys: list[Key]) -> dict[str, Any]:
    """Return `data` without these keys. A key removes the whole channel or the whole recording."""
    kept = {key: dict(value) if isinstance(value, dict) else value for key, value in data.items()}
    for key in keys:
        table = kept if len(key) == 1 else kept.get(str(key[0])) if key else None
        if isinstance(table, dict):
            table.pop(str(key[:2][-1]), None)
    return kept


def _in_campaign(path: Path, text: str, key: Key, what: str) -> Finding:
    problem, _, do = what.partition("; ")
    name = f"{dotted(key)}: " if key else ""
    return Finding("error", path, locate(text, key), name + problem, do or "correct it")


def _recording_findings(
    path: Path,
    form: CampaignForm,
    name: str,
    conversions: Mapping[str, Conversion],
    pairs: Mapping[str, str],
) -> tuple[list[Finding], str | None, Seen | None]:
    """Findings, a fingerprint of the readings (equal for equal recordings), and the recording."""
    recording = form.recordings[name]
    file = path.parent / recording.file
    wanted = wanted_columns(recording, form.channels)
    known = {c: one for c, one in form.channels.items() if c in conversions}
    how = how_to_read(recording, known, conversions, pairs)
    columns, findings = read_columns(file, list(wanted.values()), how)
    if columns is None:
        return findings, None, None
    for name, count in columns.left_out.items():
        what = f"{count} lone values of '{name}' are far from all around them"
        findings.append(Finding("warning", file, None, what, "they are not used; look at the sensor"))
    findings.extend(_header_findings(file, columns, form, recording))
    pauses = written_on_change(list(columns.values.values()))
    findings.extend(clock_findings(file, columns, pauses=pauses))
    channels = {
        name: make_channel(name, one, conversions[name])
        for name, one in form.channels.items()
        if name in conversions
    }
    values = channel_values(columns, recording, form.channels, conversions)
    findings.extend(_content_findings(file, columns, channels, recording, values))
    findings.extend(input_findings(file, columns, channels, values, pauses=pauses))
    findings.extend(correction_findings(file, columns, values, pairs))
    print_of = fingerprint(columns.time, [v for c, v in values.items() if channels[c].measured])
    whole = None
    if columns.runs_forward and len(values) == len(channels):
        read = {c: v for c, v in values.items() if np.isfinite(v).any()}
        plausible = {c: _plausible(channels[c], v) for c, v in read.items()}
        time = columns.time - columns.time[0]
        whole = Seen(name, file, time, plausible, columns.lines, frozenset(recording.set))
    return findings, print_of, whole


def _plausible(channel: Channel, values: Array) -> Array:
    """Return the values without those that have a finding of their own. They would disturb the comparison
    of recordings.
    """
    known = np.flatnonzero(np.isfinite(values))
    wrong = known[odd_readings(channel, values[known])]
    found = np.where(np.isfinite(values), values, np.nan)
    found[wrong] = np.nan
    return found


def _header_findings(
    file: Path, columns: Columns, form: CampaignForm, recording: RecordingForm
) -> Iterator[Finding]:
    for channel, column in wanted_columns(recording, form.channels).items():
        if column not in columns.header:
            do = f"add it, or say set = {{ {channel} = ... }}; the columns are {', '.join(columns.header)}"
            yield Finding("error", file, 1, f"no column '{column}'", do)
    declared = {one.column or name for name, one in form.channels.items()}
    for name in dict.fromkeys(columns.header):
        if name not in declared and name != TIME:
            what = f"the column '{name}' is not among the channels"
            do = "it is not used; declare it in the campaign file if it matters"
            yield Finding("warning", file, 1, what, do, "stray column", name, 0.1)
    for name in recording.set:
        if name in columns.header:
            what = f"'{name}' is a column here and a constant in the campaign file"
            yield Finding("warning", file, 1, what, "the constant is used; take one of the two away")


def _content_findings(
    file: Path,
    columns: Columns,
    channels: Mapping[str, Channel],
    recording: RecordingForm,
    values: Mapping[str, Array],
) -> Iterator[Finding]:
    for name, column in values.items():
        yield from range_findings(file, columns.lines, channels[name], column)
        yield from load_findings(file, columns.lines, channels[name], column)
        yield from small_findings(file, columns.lines, channels[name], column)
        if name not in recording.set:
            yield from frozen_findings(file, columns.lines, channels[name], column)
            yield from odd_findings(file, columns.lines, channels[name], column, columns.time)
            if channels[name].measured:
                yield from few_findings(file, channels[name], column)
