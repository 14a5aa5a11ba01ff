"""When an event of one recording acts: its instants on the clock of the recording, and in words."""

from __future__ import annotations

from discovery.effects.hypothesis import Hypothesis
from discovery.printed import spanned
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
    when = f" {'from' if len(times) == 2 else 'at'} {spanned(times)}" if times else ""
    return f"{at}in {h.recording}{when}"
