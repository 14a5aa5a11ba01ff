"""Charts of a run: measured and predicted outputs, inputs, residuals and their autocorrelation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.report.chart import Chart, Panel, Series
from discovery.report.ranking import rms_unit
from discovery.report.run import Run, pretty_unit
from discovery.report.text import number, with_unit

Array = NDArray[np.float64]

BAND = "95 % band of the best model"
FEWEST = 12  # residuals from which an autocorrelation is computed
_COLORS = 8  # of curves in the style sheet


def time_axis(time: Array) -> tuple[Array, str, float]:
    """Time in hours or minutes, the label, and the seconds of one unit."""
    scale, unit = (3600.0, "h") if len(time) and time[-1] - time[0] > 3 * 3600 else (60.0, "min")
    return time / scale, f"time [{unit}]", scale


def prediction_charts(run: Run, models: Sequence[str]) -> list[Chart]:
    """One chart for each recording and error: readings and models above, residuals below; then its inputs."""
    return [
        chart
        for recording in run.recordings
        for chart in (
            *(
                _prediction_chart(run, recording, output, models)
                for output in run.predictions[recording].readings
            ),
            *_input_charts(run, recording),
        )
    ]


def _input_charts(run: Run, recording: str) -> list[Chart]:
    """Return at most one chart of the inputs of a recording, with a panel for each unit."""
    inputs, time = run.inputs.get(recording, {}), run.predictions[recording].time
    if not inputs or not len(time):
        return []
    _, label, scale = time_axis(time)
    units = run.results.get("input_units") or {}
    by_unit: dict[str, list[Series]] = {}
    for index, (name, (at, value)) in enumerate(inputs.items()):
        series = Series(name, at / scale, value, "line", str(index % _COLORS))
        by_unit.setdefault(pretty_unit(str(units.get(name, ""))), []).append(series)
    panels = tuple(
        Panel(
            with_unit(series[0].name if len(series) == 1 else "inputs", unit),
            tuple(series),
        )
        for unit, series in by_unit.items()
    )
    return [
        Chart(f"{recording}-inputs", f"Inputs of {recording}", label, panels, group=recording, solid=True)
    ]


def _prediction_chart(run: Run, recording: str, output: str, models: Sequence[str]) -> Chart:
    data = run.predictions[recording]
    x, label, scale = time_axis(data.time)
    unit = run.unit(output)
    above = [Series("measured", x, data.readings[output], "points", "measured")]
    below = []
    noise = run.noise(output)
    if noise:
        read = x[np.isfinite(data.readings[output])]
        flat = np.zeros_like(read)
        below.append(
            Series("reading noise, ±2σ", read, flat, "band", "noise", flat - 2 * noise, flat + 2 * noise)
        )
    for model in models[:1]:
        half = run.band(model, output)
        if half is not None and output in data.models.get(model, {}):
            middle = data.models[model][output]
            known = np.isfinite(middle)
            ends = middle[known] - half, middle[known] + half
            above.insert(0, Series(BAND, x[known], middle[known], "band", "0", *ends))
    for index, model in enumerate(models):
        if output in data.models.get(model, {}):
            above.append(Series(model, x, data.models[model][output], "line", str(index)))
            below.append(Series(model, x, data.left_over(model, output), "line", str(index)))
    return Chart(
        f"{recording}-{output}",
        f"{output} on {recording}",
        label,
        (
            Panel(with_unit(output, unit), tuple(above)),
            Panel(with_unit("residual", rms_unit(run, output)), tuple(below), zero=True),
        ),
        _windows(run, recording, scale),
        group=recording,
        own_key=False,
    )


def _windows(run: Run, recording: str, scale: float) -> tuple[tuple[float, float, str], ...]:
    location = (run.diagnosis or {}).get("location", {})
    shades = []
    for window in location.get("windows", []):
        if window.get("recording") == recording:
            heat, state = window.get("heat_W"), window.get("state")
            unit = pretty_unit(location.get("heat_units", {}).get(state, "W"))
            why = (
                "mismatch"
                + (f" at {state}" if state else "")
                + (f", {number(heat)} {unit}" if heat is not None else "")
            )
            shades.append((window["start_s"] / scale, window["end_s"] / scale, why))
    return tuple(shades)


def residual_charts(run: Run, model: str, recording: str) -> list[Chart]:
    """Autocorrelation of the residual of a model, one chart for each output."""
    charts = []
    for output, left in _left_over(run, model, recording):
        correlation = autocorrelation(left, min(40, len(left) // 3))
        lag = np.arange(1.0, len(correlation) + 1)
        edge = np.full_like(lag, 1.96 / np.sqrt(len(left)))
        band = Series("white noise, 95 %", lag, np.zeros_like(lag), "band", "noise", -edge, edge)
        bars = Series("autocorrelation", lag, correlation, "bars", "0")
        charts.append(
            Chart(
                f"acf-{output}",
                f"{output}: autocorrelation of the residual",
                "lag [readings]",
                (Panel("autocorrelation [-]", (band, bars), zero=True),),
            )
        )
    return charts


def _left_over(run: Run, model: str, recording: str) -> Iterator[tuple[str, Array]]:
    """Return the residual of a model for each output that has enough readings."""
    data = run.predictions[recording]
    for output in data.readings:
        if output in data.models.get(model, {}):
            left = data.left_over(model, output)
            left = left[np.isfinite(left)]
            if len(left) >= FEWEST:
                yield output, left


def autocorrelation(values: Array, lags: int) -> Array:
    """Sample autocorrelation at lags 1..lags, (lags,) (Box & Jenkins, r_k = c_k/c_0)."""
    centred = values - values.mean()
    total = float(centred @ centred) or 1.0
    return np.array([float(centred[k:] @ centred[:-k]) / total for k in range(1, lags + 1)])


def residual_table(run: Run, model: str, recording: str) -> list[dict[str, Any]]:
    """The residual of each output in figures: rms against noise, mean, autocorrelation, largest."""
    rows: list[dict[str, Any]] = []
    for output, left in _left_over(run, model, recording):
        spread = float(np.std(left)) or 1.0
        rms, noise = float(np.sqrt(np.mean(left**2))), run.noise(output)
        half = run.band(model, output)
        rows.append(
            {
                "output": output,
                "unit": rms_unit(run, output),
                "rms": rms,
                "ratio": rms / noise if noise else None,
                "mean": float(left.mean()),
                "memory": float(autocorrelation(left, 1)[0]),
                "largest": float(np.abs(left).max()),
                "beyond": 100 * float(np.mean(np.abs(left - left.mean()) > 3 * spread)),
                "inside": 100 * float(np.mean(np.abs(left) <= half)) if half else None,
                "count": len(left),
            }
        )
    return rows
