"""A fit as text, frame and picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from discovery.dynamics import predict
from discovery.printed import printed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from discovery.fitting.fit import Fit


def to_frame(fit: Fit) -> pd.DataFrame:
    """A row for each parameter: value, low and high (95 % interval), unit, fixed."""
    import pandas as pd

    rows = {
        name: {"value": p.value, "low": p.low, "high": p.high, "unit": p.unit, "fixed": p.fixed}
        for name, p in fit.model.parameters.items()
    }
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=["value", "low", "high", "unit", "fixed"])
    return frame.astype({"low": float, "high": float})


def summary(fit: Fit) -> str:
    """Parameters with 95 % intervals, rms of the residual by recording, what is not determined."""
    lines = [f"Model '{fit.model.name}', {len(fit.model.free)} free parameters", ""]
    width = max(map(len, fit.model.parameters), default=0)
    for name, p in fit.model.parameters.items():
        interval = "fixed" if p.fixed else ""
        if p.low is not None and p.high is not None:
            interval = f"({printed(p.low, 4)} to {printed(p.high, 4)})"
        unit = "" if p.unit == "1" else f" {p.unit}"
        lines.append(f"  {name:<{width}} = {printed(p.value, 4)}{unit} {interval}".rstrip())
    lines += ["", "rms of the residual"]
    for recording, left in fit.residuals().items():
        rms = np.sqrt(np.nanmean(left**2, axis=0))
        each = ", ".join(f"{y} {printed(float(v))}" for y, v in zip(fit.problem.outputs, rms, strict=True))
        lines.append(f"  {recording}: {each}")
    if fit.unidentified:
        lines += ["", "Not determined by these recordings", *(f"  {one}" for one in fit.unidentified)]
    return "\n".join(lines)


def plot(fit: Fit) -> Figure:
    """Readings and model of each fitted recording (columns) and output (rows)."""
    from matplotlib.figure import Figure

    outputs, runs = fit.problem.outputs, fit.trajectories
    figure = Figure(figsize=(5 * len(runs), 2.2 * len(outputs)), layout="constrained")
    panels = figure.subplots(len(outputs), len(runs), squeeze=False, sharex="col")
    for column, trajectory in enumerate(runs):
        grid, predicted = trajectory.system.grid, predict(trajectory)
        hours = grid.time[grid.read] / 3600
        for row, output in enumerate(outputs):
            axes = panels[row, column]
            axes.plot(hours, grid.readings[:, row], ".", color="0.6", ms=3, label="measured")
            axes.plot(hours, predicted[:, row], lw=1.2, label=fit.model.name)
            axes.set_ylabel(output)
        panels[0, column].set_title(grid.recording)
        panels[-1, column].set_xlabel("time [h]")
    panels[0, 0].legend(fontsize="small")
    return figure
