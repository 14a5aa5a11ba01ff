"""Keeping up with an ageing machine: the next revision of a model, where new readings ask for one."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discovery.export.document import Exported, from_document, read_document, render, write_document
from discovery.export.knowledge import read_knowledge
from discovery.export.seal import open_seal
from discovery.export.trend import DAY_S
from discovery.recordings import Campaign
from discovery.runtime.advice import to_distinguish
from discovery.runtime.hypotheses import Comparison, compare, model_with, residual_lately
from discovery.runtime.newphysics import sizes_of
from discovery.runtime.unused import with_input, without_input
from discovery.runtime.verdict import LEAST_ODDS
from discovery.runtime.wear import trend_of

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey


MAY = 0.95  # residual after a change, as a share of that before: a revision that gains less is not written


@dataclass(frozen=True)
class Update:
    """What an update found and wrote; `path` None: nothing to change. `after`: residual of the next revision
    in units of that of the fit. `advice`: what to record, where the recordings distinguish too little.
    """

    comparison: Comparison
    path: Path | None = None
    after: float | None = None
    advice: str = "measure more often"

    def lines(self) -> list[str]:
        """What a user wants to know of it."""
        lines = [str(self.comparison)]
        found = self.comparison
        if found.probability is not None:
            lines.append(f"{found.what}: probability {found.probability:.2f}; {_size(found)}")
        if self.path is not None:
            lines.append(
                f"{self.path}: the next revision, residual {self.after:.2f} of the fit's; "
                f"`discovery compensate` "
                "runs it in the shadow of the active one first"
            )
            return lines
        lines.append(f"the model is kept: {_why(found, self.advice)}")
        if found.unseen:
            hidden = "; ".join(f"{name} up to {size}" for name, size in found.unseen.items())
            lines.append(f"smaller changes may be hidden, in the numbers of the model: {hidden}")
        return lines


def _size(found: Comparison) -> str:
    """How large the effect is that began."""
    if found.share is None:
        return sizes_of(found.physics[found.what])
    return f"all of it changed by about {100 * found.share:+.0f} %, as with a fan or a door"


def _why(found: Comparison, advice: str) -> str:
    match found.verdict:
        case "nothing":
            return "these recordings show no change of the machine" + _perhaps(found)
        case "input sensor":
            return f"the sensor of {found.what} has an offset; check it. No parameter is changed to hide it"
        case "undecided":
            return f"{found.what}: these recordings do not distinguish them; {advice}"
        case "something else":
            return (
                "something changed that wear cannot change and no effect of the catalogue explains; look at "
                "the machine, then record it and fit the model again"
            )
        case "new physics" if found.share is not None:
            return f"the {found.what} changed; record the machine as it is now, and fit the model again"
        case "new physics":
            return f"add {found.what} to it, record the machine as it is now, and fit the model again"
        case _:
            return "the revision would not lower the residual"


def _perhaps(found: Comparison) -> str:
    """What may have begun, where it is more likely than no change and yet not sure."""
    likely = max(found.odds, key=lambda name: found.odds[name], default="nothing")
    if found.odds.get(likely, 0.0) < LEAST_ODDS:
        return ""
    return (
        f" that is sure; {likely} may have begun ({found.odds[likely]:+.1f}). The model leaves "
        f"{found.rms:.1f} times the residual of its fit, which its unsure parameters and laws may explain, "
        "too; check that, and record more"
    )


def update_file(
    path: Path, campaign: Campaign, recordings: Sequence[str], out: Path, key: Ed25519PrivateKey | None = None
) -> Update:
    """`discovery update`: compare what may have changed, and write the next revision where it is wear.

    Raises:
        UserError: a model that cannot be updated, or recordings without readings.
    """
    exported = read_document(path)
    found = compare(exported, campaign, recordings)
    revised = revision_of(exported, campaign, found)
    if revised is None:
        return Update(found, advice=to_distinguish(exported, campaign, recordings))
    document, after = revised
    write_document(out, document, key)
    return Update(found, out, after)


def revision_of(
    exported: Exported,
    campaign: Campaign,
    found: Comparison,
    begin: Mapping[str, float] | None = None,
    since: float | None = None,
) -> tuple[dict[str, Any], float] | None:
    """The document of the next revision and the residual that it leaves; None where there is no wear, or
    where it gains nothing.

    Args:
        begin: states of the model where the recordings begin; default its own start.
        since: instant [s] where the recording begins; the revision holds the trend of wear then.
    """
    if found.verdict not in ("wear", "wear goes on", "unused input", "idle input"):
        return None
    document = next_revision(exported, campaign, found, since)
    again = from_document(*open_seal(render(document), exported.model.name), exported.model.name)
    after = residual_lately(again, campaign, found.recordings, begin, since)
    return (document, after) if after < MAY * found.lately else None


def next_name(path: Path) -> Path:
    """Path of the next revision of a model, in the same folder."""
    revision = read_document(path).revision + 1
    stem = path.stem.removesuffix(f".r{revision - 1}")
    return path.with_name(f"{stem}.r{revision}{path.suffix}")


def next_revision(
    exported: Exported, campaign: Campaign, found: Comparison, since: float | None = None
) -> dict[str, Any]:
    """The document of the updated model with its changelog entry; only what wear can change has moved, or an
    input has come in or is left out. Ranges and limits stay. What is known of the parameters after wear goes
    with the revision: the next comparison holds it to that.
    """
    if found.verdict == "unused input" and found.path is not None:
        path, values = found.path
        moved = f"{path.channel} is an input now, with a lag of {path.lag:g} s: "
        moved += ", ".join(f"{n} {value:.3g}" for n, value in values.items())
        return _revised(exported, with_input(exported, campaign, path, values), found, moved)
    if found.verdict == "idle input":
        document = without_input(exported, campaign, found.what)
        return _revised(exported, document, found, f"{found.what} is no input any more")
    document, moving, trend = {**exported.document}, exported.model, None
    document.pop("trend", None)
    if since is not None:
        lasted = sum(float(campaign.recordings[r].time[-1]) for r in found.recordings)
        if exported.trend is not None:
            moving = moving.with_values(exported.trend.values(moving, since + lasted))
        trend = trend_of(exported, found.during, lasted / DAY_S, since + lasted)
    model = model_with(moving, found.change)
    entries = []
    for entry in document["parameters"]:
        p = model.parameters[entry["name"]]
        entries.append({**entry, "value": p.value, "low": p.low, "high": p.high})
    moved = ", ".join(
        f"{n} {exported.model.parameters[n].value:.4g} -> {model.parameters[n].value:.4g}"
        for n in found.change
    )
    before = read_knowledge(model.name, document["knowledge"])
    known = replace(before, rows=found.rows, worn=tuple(sorted({*before.worn, *found.change})))
    if trend is not None:
        document["trend"] = trend.document()
        moved += "; a day: " + ", ".join(f"{n} {rate:+.2g}" for n, rate in trend.per_day.items())
    new = document | {"parameters": entries, "knowledge": known.document()}
    return _revised(exported, new, found, moved)


def _revised(exported: Exported, document: dict[str, Any], found: Comparison, moved: str) -> dict[str, Any]:
    """A document as the next revision, with an entry in its changelog."""
    note = {
        "revision": exported.revision + 1,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "text": f"{found}; {moved}",
        "of": exported.seal.sha256,
    }
    return document | {"revision": note["revision"], "changelog": [*document["changelog"], note]}
