"""What the running loop records for an update: rows of inputs, and measured errors at their instants."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported
from discovery.recordings import Campaign, Channel, Recording
from discovery.runtime.compensator import Compensator

Array = NDArray[np.float64]

ROW_S = 60.0  # of a row. The mean of a longer one lies between operating points, where no fit knows its laws
EARLY_S = 1e-6  # by which a tick may come too early
UNKNOWN_S = 300.0  # after which an input may have switched meanwhile
LATELY_S = 3600.0  # over which the mean of such an input is taken
MARK_S = 6 * 3600.0  # between two rows where the states of the model are kept
LONGEST_S = 8 * 24 * 3600.0  # of the recording; the older half is forgotten then


@dataclass
class Recorder:
    """Rows (N): instants `times` where they begin, mean inputs until the next row, other readings and
    measured errors where the row begins. `marks`: rows with the states of the model there.
    """

    times: list[float] = field(default_factory=list)
    inputs: list[list[float]] = field(default_factory=list)
    others: list[dict[str, float]] = field(default_factory=list)  # readings that the model does not use
    errors: list[dict[str, float]] = field(default_factory=list)
    marks: list[tuple[int, dict[str, float]]] = field(default_factory=list)
    read: dict[str, float] = field(default_factory=dict)  # instant of the last reading of each error
    last: tuple[float, Array] | None = None  # instant of the last tick, and its inputs
    integral: Array | float = 0.0  # of the inputs (U,) over the last row, until the last tick

    def clear(self) -> None:
        """Forget everything."""
        for rows in (self.times, self.inputs, self.others, self.errors, self.marks):
            rows.clear()
        self.read.clear()
        self.last = None

    def add(
        self, compensator: Compensator, now: float, others: Mapping[str, float], errors: Mapping[str, float]
    ) -> bool:
        """Take in a tick; whether it has errors that stand in a row: one reading of each in the time of a
        row, at its instant.
        """
        assert compensator.inputs is not None
        if self.times and now <= self.times[-1]:
            return False
        self._integrate(compensator, now)
        errors = {n: e for n, e in errors.items() if now - self.read.get(n, -math.inf) > ROW_S - EARLY_S}
        if self.times and not errors and now - self.times[-1] < ROW_S - EARLY_S:
            return False
        if not self.marks or now - self.times[self.marks[-1][0]] >= MARK_S:
            self.marks.append((len(self.times), compensator.states()))
        self.times.append(now)
        self.inputs.append(compensator.inputs.tolist())
        self.integral = 0.0
        self.others.append(dict(others))
        self.errors.append(errors)
        self.read |= dict.fromkeys(errors, now)
        if now - self.times[0] > LONGEST_S and len(self.marks) >= 3:
            self.begin_at(len(self.marks) // 2)
        return bool(errors)

    def _integrate(self, compensator: Compensator, now: float) -> None:
        """Bring the means of the last row to this tick. A held input keeps its value from tick to tick,
        another one runs straight. Where it is not known for minutes, its mean of the last hour holds.
        """
        assert compensator.inputs is not None
        before, self.last = self.last, (now, compensator.inputs.copy())
        if before is None or not self.times:
            return
        held = np.array([spec.between == "held" for spec in compensator.exported.inputs])
        passed, straight = now - before[0], 0.5 * (before[1] + compensator.inputs)
        kept = before[1] if passed <= UNKNOWN_S else self._lately()
        self.integral = self.integral + passed * np.where(held, kept, straight)
        self.inputs[-1] = np.asarray(self.integral / (now - self.times[-1])).tolist()

    def _lately(self) -> Array:
        """Mean inputs (U,) over the rows of the last hour."""
        first = bisect_left(self.times, self.times[-1] - LATELY_S)
        length = np.diff([*self.times[first:], self.times[-1] + ROW_S])
        return np.asarray(np.average(self.inputs[first:], axis=0, weights=length))

    def mark(self, compensator: Compensator) -> None:
        """Keep the states of the model at the last row."""
        if self.marks[-1][0] < len(self.times) - 1:
            self.marks.append((len(self.times) - 1, compensator.states()))

    def begin_at(self, mark: int) -> None:
        """Let the recording begin at a mark."""
        first = self.marks[mark][0]
        for rows in (self.times, self.inputs, self.others, self.errors):
            del rows[:first]
        self.marks = [(row - first, states) for row, states in self.marks[mark:]]

    def resume(self) -> None:
        """Go on with rows that were kept on disk: the time until the next tick is a gap."""
        if self.times:
            self.last = self.times[-1], np.array(self.inputs[-1])

    def campaign(self, exported: Exported) -> Campaign:
        """What was recorded, as a campaign of one recording. Inputs are held at their means."""
        time = np.array(self.times) - self.times[0]
        values = dict(zip(exported.compiled.inputs, np.array(self.inputs).T, strict=True))
        channels = {i.name: Channel(i.name, i.role, i.unit, None, "held") for i in exported.inputs}
        for o in exported.outputs:
            if o.role == "error":
                values[o.name] = np.array([row.get(o.name, math.nan) for row in self.errors])
                channels[o.name] = Channel(o.name, "error", o.unit, None, "held")
        for name in sorted(set().union(*self.others)):
            values[name] = np.array([row.get(name, math.nan) for row in self.others])
            channels[name] = Channel(name, "other input", "1", None, "linear")
        return Campaign("running", channels, {"running": Recording("running", time, values)}, Path("running"))
