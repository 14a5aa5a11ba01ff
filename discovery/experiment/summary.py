"""What a run found, in a few lines for the terminal; several runs side by side."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from discovery.evaluation.rolematrix import matrix
from discovery.evaluation.tables import Table, as_text, without_model
from discovery.models.units import differences
from discovery.report.compare import groups, labels_of, merged, shared_recordings
from discovery.report.printed import Printed
from discovery.report.printed import summary as all_held_out
from discovery.report.run import Run, load_run
from discovery.report.runlist import run_list
from discovery.runfolder import read_results

MOST_NOTES = 5  # of a model, in the terminal
_MOST_TABLES = 4  # runs whose models are printed one by one
_MOST_RECORDINGS = 6  # with a table each
_PARTS = {"fitted": "fit", "held out": "held_out"}


def summary(folder: Path) -> Iterator[str]:
    """rms of each model, on each recording or over many, the notes, and where the report is."""
    results = read_results(folder)
    yield from _rms(load_run(folder), {"": results}, (*results["fit"], *results["held_out"]))
    if roles := results.get("role_matrix"):
        for error in results["outputs"]:
            yield as_text(matrix(roles, error, differences(results["units"].get(error, ""))))
            yield ""
    yield from remarks(folder)
    if "paper" in results:
        yield from (one["failed"] for one in results["paper"].values() if one.get("failed"))
        yield f"the paper, figure by figure: {folder / 'paper.html'}"
    yield f"{results['seconds']:.0f} s; the report: {folder / 'report.html'}"


def remarks(folder: Path) -> Iterator[str]:
    """The notes of each model, and that something is wrong with the recordings."""
    results = read_results(folder)
    said: dict[str, list[str]] = {}
    for name, model in results["models"].items():
        notes = model["notes"]
        for note in notes[:MOST_NOTES]:
            said.setdefault(note, []).append(name)
        if len(notes) > MOST_NOTES:
            more = len(notes) - MOST_NOTES
            said.setdefault(f"{more} more note{'s' * (more > 1)} in results.json", []).append(name)
    yield from (f"note, {', '.join(models)}: {note}" for note, models in said.items())
    if findings := results["findings"]:
        worst = min(findings, key=lambda one: not one.startswith("error"))
        many = f"{len(findings)} findings in the recordings, the first: " if findings[1:] else ""
        check = f"`discovery check {shlex.quote(results['campaign_file'])}`"
        yield f"{many}{worst}; {check} lists what is wrong with the recordings"


def comparison(runs: Sequence[Run]) -> Iterator[str]:
    """Runs and how they differ from the first; of a few, also the rms of every model on the recordings
    that runs share.
    """
    labels, listing = labels_of(runs), run_list(runs, labels_of(runs), Path())
    yield as_text(Table(listing.title, listing.header[:-1], tuple(row.cells[:-1] for row in listing.rows)))
    yield ""
    for row in listing.rows[1:]:
        yield f"{row.cells[0]} differs from {labels[0]}: {row.cells[-1]}"
    yield ""
    if len(runs) > _MOST_TABLES:
        return
    together = [of for of in groups(runs) if len(of) > 1]
    if not together:
        yield "These runs share no recording, so their models are not compared side by side."
    for of in together:
        results = {labels[k]: runs[k].results for k in of}
        yield from _rms(merged(runs, Path(), of), results, shared_recordings([runs[k] for k in of]))


def _rms(run: Run, results: Mapping[str, Mapping[str, Any]], recordings: Sequence[str]) -> Iterator[str]:
    """Return a table for each recording. If there are many, return one table of all held-out recordings, as
    in the report.
    """
    if len(recordings) <= _MOST_RECORDINGS:
        tables = [rms_table(results, recording) for recording in recordings]
    else:
        tables = [_plain(table) for table in (all_held_out(run),) if table]
    for table in tables:
        yield as_text(table)
        yield ""


def _plain(table: Printed) -> Table:
    """A table of the page for the terminal."""
    return Table(table.title, table.header, tuple(row.cells for row in table.rows))


def rms_table(runs: Mapping[str, Mapping[str, Any]], recording: str) -> Table:
    """rms of each output, a row for each model that predicted the recording; first without one."""
    rows: list[tuple[str | float | None, ...]] = []
    models = [model for one in runs.values() for model in one["models"].values()]
    outputs = list(dict.fromkeys(y for m in models for scores in m["recordings"].values() for y in scores))
    parts: set[str] = set()
    for run, results in runs.items():
        parts |= {said for said, key in _PARTS.items() if recording in results[key]}
        entries = {name: m["recordings"].get(recording, {}) for name, m in results["models"].items()}
        if not any(entries.values()):
            continue
        raw = {y: e["uncompensated"]["rms"] for entry in entries.values() for y, e in entry.items()}
        label = f"{run}: " if run else ""
        rows.append((f"{label}{without_model(results, outputs)}", "", *(raw.get(y) for y in outputs)))
        for name, entry in entries.items():
            terms = results["models"][name]["terms"]
            size = f"{terms} terms" if terms else ""
            rows.append((label + name, size, *(entry[y]["rms"] if y in entry else None for y in outputs)))
    units = {y: unit for one in runs.values() for y, unit in one.get("units", {}).items()}
    header = ("rms", "", *(f"{y} [{differences(units.get(y, ''))}]" for y in outputs))
    return Table(f"Recording '{recording}' ({' / '.join(sorted(parts))})", header, tuple(rows))
