"""One figure, table or equation of the paper: what the paper says, what is found here, what it shows."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from traceback import extract_tb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.evaluation.tables import Table
from discovery.experiment.experiment import Experiment
from discovery.experiment.fitted import Fitted
from discovery.experiment.form import PaperForm
from discovery.report.chart import Chart

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chapter:
    """`paper`: what the paper says or measured. `shows`, `not_shown`: what the figures here show, and what
    they do not. `failed`: why the chapter could not be made, in one sentence.
    """

    key: str
    title: str
    paper: str
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
    shows: tuple[str, ...] = ()
    not_shown: tuple[str, ...] = ()
    failed: str = ""

    def document(self) -> dict[str, Any]:
        """What results.json holds of it."""
        return {
            "title": self.title,
            "shows": list(self.shows),
            "does_not_show": list(self.not_shown),
            "tables": [
                {"title": t.title, "header": list(t.header), "rows": [list(row) for row in t.rows]}
                for t in self.tables
            ],
            **({"failed": self.failed} if self.failed else {}),
        }


def attempted(name: str, make: Callable[[], Chapter | None]) -> Chapter | None:
    """The chapter that `make` makes; if it fails, one that says why. The rest of the run stands then.

    Args:
        name: what the chapter is about, for the sentence.
    """
    try:
        return make()
    except UserError as error:
        why = str(error)
    except Exception as error:  # an error in the code of one chapter must not cost the run either
        place = extract_tb(error.__traceback__)[-1]
        why = f"internal error {error!r} in {Path(place.filename).name}, line {place.lineno}"
    key = "-".join(re.findall(r"[a-z0-9]+", name.lower()))
    failed = f"The chapter “{name}” could not be made: {why.rstrip('.')}."
    return Chapter(f"{key}-not-made", f"{name[:1].upper()}{name[1:]}: not made", "", failed=failed)


@dataclass(frozen=True)
class Material:
    """What the chapters are made from. `results`: content of results.json."""

    experiment: Experiment
    fitted: Mapping[str, Fitted]
    results: Mapping[str, Any]
    form: PaperForm = field(repr=False)

    @cached_property
    def errors(self) -> tuple[str, ...]:
        """Errors that are compared."""
        return self.experiment.outputs

    def unit(self, name: str) -> str:
        """Unit of a channel."""
        return self.experiment.campaign.channels[name].unit

    def read(self, recording: str, channel: str) -> tuple[Array, Array]:
        """Instants [s] and values of a channel where it was read."""
        data = self.experiment.campaign.recordings[recording]
        values = data.values.get(channel, np.full(len(data.time), np.nan))
        seen = np.isfinite(values)
        return data.time[seen], values[seen]

    def judged_on(self) -> list[str]:
        """Recordings that no fit has seen."""
        return [name for name in self.experiment.held_out if name in self.results["held_out"]]
