"""When an event of one recording acts: its instants on the clock of the recording, and in words."""

from __future__ import annotations

from discovery.effects.hypothesis import Hypothesis
from discovery.printed import printed
from discovery.recordings import Campaign


def instants(campaign: Campaign, h: Hypothesis) -> tuple[float, ...]:
    """The instants [s] that were searched for a claim: begin and end of heat, or a jump; none for others.

    What begins before the recording or ends after it does so with it.
    """
    if h.recording is None:
        return ()
    recording = campaign.recordings[h.recording]
    first, last = float(recording.time[0]), float(recording.time[-1])
    return tuple(recording.start + min(max(h.shapes[name], first), last) for name in h.spans)


def in_words(campaign: Campaign, h: Hypothesis) -> str:
    """Place, recording and hours of an event: "at head in wed from 17.6 to 23.3 h"."""
    at = f"at {', '.join(h.places)} " if h.places else ""
    times = instants(campaign, h)
    unit, size = next(
        (u, s) for u, s in (("h", 3600.0), ("min", 60.0), ("s", 0.0)) if max(times, default=0) >= s
    )
    hours = [printed(t / (size or 1.0)) for t in times]
    when = (
        f" from {hours[0]} to {hours[1]} {unit}"
        if len(hours) == 2
        else f" at {hours[0]} {unit}"
        if hours
        else ""
    )
    return f"{at}in {h.recording}{when}"
