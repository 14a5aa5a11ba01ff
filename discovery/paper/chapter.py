"""One figure, table or equation of the paper: what the paper says, what is found here, what it shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.evaluation.tables import Table
from discovery.experiment.experiment import Experiment
from discovery.experiment.fitted import Fitted
from discovery.experiment.form import PaperForm
from discovery.report.chart import Chart

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chapter:
    """`paper`: what the paper says or measured. `shows`, `not_shown`: what the figures here show, and what
    they do not.
    """

    key: str
    title: str
    paper: str
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
    shows: tuple[str, ...] = ()
    not_shown: tuple[str, ...] = ()

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
        }


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
