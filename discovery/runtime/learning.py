"""Adaptive learning in the running loop: when to measure, when to update, and the update itself.

Measured errors are compared with the prediction as they come. Beyond the action limit the compensation asks
for measurements; with enough of them the hypotheses of `discovery update` are compared, and a model that
follows the wear of the machine is signed and runs in the shadow, where measured errors must confirm it (the
action limits and on-demand measurements follow Blaser et al., CIRP Annals 66, 2017, adaptive learning control
for thermal error compensation).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel
from pydantic_core import to_json

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.files import write_atomic
from discovery.recordings import Campaign
from discovery.runtime.compensator import Compensator, State
from discovery.runtime.guards import Reading, number
from discovery.runtime.hypotheses import Comparison, compare
from discovery.runtime.measured import new_errors
from discovery.runtime.recorder import Recorder
from discovery.runtime.shadow import predictions
from discovery.runtime.update import revision_of

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

ACTION = 1.6  # rms of the last errors left, in units of the residual of the fit: measure
UNCERTAIN = 0.5  # residuals of the fit by which predictions are uncertain after a gap: measure
RECENT = 32  # errors that the action limit looks at
FILE = "learning.json"
ROWS = ("times", "inputs", "others", "errors", "marks")
OWN = ("left", "counted", "new", "compared", "advice", "because")
LEAST = 6  # new errors of at least one output before hypotheses are compared
EVERY_S = 6 * 3600.0  # between two comparisons where the action limit is kept ...
SOON_S = 4 * 3600.0  # ... and where it is not
GAP_S = 3600.0  # after a longer gap the recording begins anew
SAVE_S = 600.0  # between two copies on disk; what comes after the last one is lost with a kill


@dataclass(frozen=True)
class Question:
    """A recording of a model at work, its states where it begins, and the instant [s] of that."""

    exported: Exported
    campaign: Campaign
    begin: Mapping[str, float]
    since: float


Answer = tuple[Comparison, dict[str, Any] | None]


def answer(question: Question) -> Answer:
    """The hypotheses on what was seen, and the document of the next revision where it is wear or an input
    that the model did not use. It takes seconds, so a live source asks another process.

    Raises:
        UserError: a model without knowledge of its parameters.
    """
    exported, campaign, begin, since = question.exported, question.campaign, question.begin, question.since
    found = compare(exported, campaign, ["running"], choose=True, named=False, begin=begin, since=since)
    revised = revision_of(exported, campaign, found, begin=begin, since=since)
    return found, None if revised is None else revised[0]


class _Kept(BaseModel):
    """The file of what was seen, see `Learner`."""

    model: str
    times: list[float]
    inputs: list[list[float]]
    others: list[dict[str, float]]
    errors: list[dict[str, float]]
    marks: list[tuple[int, dict[str, float]]]
    left: list[float]
    counted: dict[str, float]
    new: int
    compared: float
    advice: str
    because: str = ""

    def fits(self, inputs: int) -> bool:
        """Whether its rows belong together, for a model of so many inputs."""
        rows = len(self.times)
        return (
            len(self.inputs) == len(self.others) == len(self.errors) == rows
            and all(len(one) == inputs for one in self.inputs)
            and all(0 <= row < rows for row, _ in self.marks)
        )


@dataclass
class Learner:
    """What the running loop knows since the last revision.

    `key` signs new revisions. `advice` is what to do now, in words, and `because` of what; empty: nothing.
    """

    key: Ed25519PrivateKey | None
    advice: str = ""
    because: str = ""  # "action limit", "after a gap"
    said: tuple[str, str] = ("", "")  # the last verdict, and of what
    seen: Recorder = field(default_factory=Recorder)
    left: list[float] = field(default_factory=list)  # errors left, in units of the residual of the fit
    counted: dict[str, float] = field(default_factory=dict)  # instant of the last reading of each error
    new: int = 0  # rows with errors since the last comparison
    compared: float = -1e30
    saved: float = -math.inf
    levels: dict[str, float] = field(default_factory=dict)

    def begin(self, compensator: Compensator) -> None:
        """Forget everything: another model is at work."""
        known = compensator.exported.document.get("knowledge", {})
        self.levels = {n: r for n, r in known.get("residual", {}).items() if r is not None}
        self.seen.clear()
        self.left.clear()
        self.new, self.advice = 0, ""

    def follow(self, compensator: Compensator, since: float | None) -> None:
        """Another model is at work that knows what was seen until `since`: keep what was seen afterwards."""
        seen, self.seen = self.seen, Recorder()
        self.begin(compensator)
        marks = [k for k, (row, _) in enumerate(seen.marks) if since and seen.times[row] <= since]
        if not marks or len(seen.inputs[0]) != len(compensator.exported.inputs):
            return
        seen.begin_at(marks[-1])
        self.seen = seen
        self.new = sum(1 for row in seen.errors if row)

    def observe(self, compensator: Compensator, readings: Mapping[str, Reading], now: float) -> bool:
        """Take in a tick; whether hypotheses should be compared now.

        What the model works with while inputs are missing is a guess, so only ACTIVE ticks are learnt from.
        """
        if self.seen.times and now - self.seen.times[-1] > GAP_S:
            self.begin(compensator)
        found = new_errors(compensator.names, readings, self.counted)
        if compensator.uncertain > UNCERTAIN:
            self.because, self.advice = "after a gap", "measure the errors every half hour for the next 4 h"
        elif self.because == "after a gap":
            self.advice = ""
        if compensator.inputs is None or compensator.state is not State.ACTIVE:
            return False
        self.new += self.seen.add(compensator, now, _others(compensator, readings), found)
        if found:
            predicted = predictions(compensator)
            for name, value in found.items():
                if name in self.levels:
                    self.left.append((value - predicted[name]) / self.levels[name])
            del self.left[:-RECENT]
        beyond = self.beyond()
        if beyond:
            self.because, self.advice = "action limit", "measure the errors every half hour for the next 8 h"
        elif self.because == "action limit":
            self.advice = ""
        wait = SOON_S if beyond else EVERY_S
        return self.new >= LEAST and now - self.compared >= wait

    def beyond(self) -> bool:
        """Whether the errors left are beyond the action limit."""
        return len(self.left) >= RECENT // 2 and math.sqrt(float(np.mean(np.square(self.left)))) > ACTION

    def save(self, compensator: Compensator, folder: Path, now: float, *, last: bool = False) -> None:
        """Keep what was seen on disk, every ten minutes and at the end; a disk that fails costs what was
        learnt since.

        Args:
            last: the program ends.
        """
        if not last and 0.0 <= now - self.saved < SAVE_S:
            return
        self.saved = now
        with suppress(OSError):
            write_atomic(folder / FILE, self.kept(compensator))

    def kept(self, compensator: Compensator) -> bytes:
        """The file of what was seen."""
        kept = {name: getattr(self.seen, name) for name in ROWS} | {name: getattr(self, name) for name in OWN}
        return to_json(kept | {"model": compensator.exported.seal.sha256}, inf_nan_mode="constants")

    def load(self, compensator: Compensator, folder: Path) -> None:
        """Go on with what was seen before a restart, if it is of the same model."""
        try:
            kept = _Kept.model_validate_json((folder / FILE).read_text())
        except (OSError, ValueError):
            return
        if kept.model == compensator.exported.seal.sha256 and kept.fits(len(compensator.exported.inputs)):
            for name in OWN:
                setattr(self, name, getattr(kept, name))
            self.seen = Recorder(**{name: getattr(kept, name) for name in ROWS})
            self.seen.resume()

    def question(self, compensator: Compensator, now: float) -> Question:
        """What was seen, for `answer`."""
        self.compared, self.new = now, 0
        campaign = self.seen.campaign(compensator.exported)
        begin = dict(self.seen.marks[0][1])
        question = Question(compensator.exported, campaign, begin, self.seen.times[0])
        self.seen.mark(compensator)
        return question


def _others(compensator: Compensator, readings: Mapping[str, Reading]) -> dict[str, float]:
    """Return good readings of columns that the model does not use. Each may be an input of the next
    revision.
    """
    known = {i.name for i in compensator.exported.inputs} | set(compensator.names)
    known |= {f"{name}_applied" for name in compensator.names}
    found = {n: number(r.value) for n, r in readings.items() if n not in known and r.good}
    return {n: value for n, value in found.items() if math.isfinite(value)}


def learner(key: Path) -> Learner:
    """A learner that signs with the private key of a file, which must be there.

    Raises:
        UserError: no such key.
    """
    from discovery.export.seal import private_key

    if not key.is_file():
        raise UserError(f"{key}: there is no such key; name the private key that signed the model")
    return Learner(private_key(key))
