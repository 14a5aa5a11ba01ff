"""A diagnosis as frame and picture; its text is `summary.lines_of`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from discovery.diagnosis.form import DiagnosisDocument

COLUMNS = ["effect", "places", "probability", "parameter", "value", "low", "high", "unit"]


def to_frame(d: DiagnosisDocument) -> pd.DataFrame:
    """A row for each parameter of each named effect, with its 95 % interval."""
    import pandas as pd

    rows = [
        (p.effect, ", ".join(p.states), p.probability, name, q.value, q.low, q.high, q.unit)
        for p in d.physics
        for name, q in p.parameters.items()
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def plot(d: DiagnosisDocument) -> Figure:
    """rms of free runs before and after the repair, a pair of bars for each recording set."""
    from matplotlib.figure import Figure

    gains = {
        "fitted": d.improvement.fit,
        **{f"{r}\n(held out)": g for r, g in d.improvement.held_out.items()},
    }
    figure = Figure(figsize=(1.5 + 1.8 * len(gains), 3.2), layout="constrained")
    axes = figure.subplots()
    for place, gain in enumerate(gains.values()):
        for shift, value, colour in ((-0.2, gain.rms_before, "0.7"), (0.2, gain.rms_after, "C0")):
            if value is not None:
                axes.bar(place + shift, value, 0.38, color=colour)
        if gain.noise_floor is not None:
            axes.hlines(gain.noise_floor, place - 0.4, place + 0.4, color="k", ls=":", lw=1)
    axes.set_xticks(range(len(gains)), list(gains))
    axes.set_ylabel(f"rms of free runs{f' [{d.improvement.unit}]' if d.improvement.unit != '1' else ''}")
    named = ", ".join(p.effect for p in d.physics)
    axes.set_title(f"{d.verdict}{f': {named}' if named else ''}\ngrey: before, blue: after, dotted: noise")
    return figure
