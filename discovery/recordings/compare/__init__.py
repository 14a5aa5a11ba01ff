"""Every channel against its siblings and against the other recordings of the campaign."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import disagreements
from discovery.recordings.compare.leaks import copied_channels, copies, near_copies
from discovery.recordings.compare.levels import level_findings
from discovery.recordings.compare.pairs import pair_findings
from discovery.recordings.compare.repairs import Disagreement
from discovery.recordings.compare.seen import Seen
from discovery.recordings.compare.temperatures import temperature_findings
from discovery.recordings.finding import Finding

__all__ = ["Seen", "compare", "copies"]

# what no fit survives keeps a recording from being used; the rest is worth a look
_ERRORS = ("unit", "time", "sign", "swap", "halfway")
_WEIGHTS = {"unit": 9.0, "time": 8.0, "sign": 7.0, "swap": 7.0, "halfway": 6.0, "factor": 4.0, "shift": 3.0}


def compare(path: Path, recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """Findings about recordings that disagree with the others, about levels, and about copies.

    Args:
        path: of the campaign file.
    """
    damaged: set[tuple[str, str]] = set()
    by_name = {one.name: one for one in recordings}
    for one in disagreements(recordings, channels):
        damaged |= {(one.recording, name) for name in one.repair.channels}
        yield _disagreement(by_name[one.recording], one)
    by_itself = (level_findings, temperature_findings, pair_findings)
    for finding in (one for found in by_itself for one in found(recordings, channels)):
        where = next((one.name for one in recordings if one.file == finding.file), "")
        if (where, finding.channel) not in damaged:  # one damage, one line
            yield finding
    yield from copied_channels(recordings, channels)
    for a, b, name in near_copies(recordings, channels):
        what = f"{a} and {b} hold the same readings of '{name}', but for noise, a scale or a cut"
        do = "keep one of the two: a copy proves nothing of a model that was fitted to the other"
        yield Finding("warning", path, None, what, do, "copy", name, 5.0)


def _disagreement(seen: Seen, one: Disagreement) -> Finding:
    repair = one.repair
    severity: Literal["error", "warning"] = "error" if repair.kind in _ERRORS else "warning"
    proof = f"undone, it agrees with the other recordings: misfit {one.before:.0%} -> {one.after:.0%}"
    channel = repair.channels[0] if repair.channels else ""
    weight = _WEIGHTS.get(repair.kind, 2.0)
    return Finding(
        severity, seen.file, None, f"{repair.what} ({proof})", repair.do, repair.kind, channel, weight
    )
