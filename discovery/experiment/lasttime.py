"""How long a run still takes, where the same run was made before: the only speed of its own steps that is
known.
"""

from __future__ import annotations

import time as clock
from pathlib import Path

from discovery.errors import UserError
from discovery.experiment.experiment import Experiment
from discovery.progress import TOO_SOON, Progress, rough
from discovery.runfolder import read_results


def with_time_left(progress: Progress, folder: Path, experiment: Experiment, began: float) -> Progress:
    """A progress that also says how long the rest takes if the run takes as long as the one in `folder`.

    Nothing is added where no such run stands there, or where this one takes longer already.

    Args:
        began: `time.perf_counter()` when the run began.
    """
    before = _seconds(folder, experiment)
    if before is None:
        return progress

    def said(what: str) -> None:
        left = before - (clock.perf_counter() - began)
        more = f", about {rough(left)} left if this takes as long as the last run" if left >= TOO_SOON else ""
        progress(f"{what}{more}")

    return said


def _seconds(folder: Path, experiment: Experiment) -> float | None:
    """Seconds of a run with the same recordings and models that stands in a folder."""
    try:
        results = read_results(folder)
    except UserError:
        return None
    further = [name for name in results["models"] if name not in experiment.form.models]
    same = (
        (results["fit"], results["held_out"]) == (list(experiment.fit), list(experiment.held_out))
        and set(experiment.form.models) <= set(results["models"])
        and all(name.startswith("repaired") for name in further)
        and str(results.get("command", "")).split(" ")[:2] == ["discovery", "run"]
    )
    seconds = results.get("seconds")
    return float(seconds) if same and isinstance(seconds, int | float) else None
