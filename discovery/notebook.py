"""Results as a notebook wants them: text, a frame, a picture, a table in the cell."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discovery.runfolder import read_results
from discovery.schema import Named

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

CRITERIA = ("rms", "peak", "mean", "variance")  # of a free run, in the unit of the output


@dataclass(frozen=True)
class RunResults:
    """The results of a run, read from its folder.

    Args:
        folder: of a finished `discovery run`, for example "runs/tclab".

    Raises:
        UserError: no results in the folder.
    """

    folder: Path

    def __post_init__(self) -> None:
        read_results(Path(self.folder))

    def __fspath__(self) -> str:
        return str(self.folder)

    @property
    def report(self) -> Path:
        """The page with all results."""
        return Path(self.folder) / "report.html"

    def summary(self) -> str:
        """Return what the command prints: rms of each model, notes, and the place of the report."""
        from discovery.experiment.summary import summary

        return "\n".join(summary(Path(self.folder)))

    def to_frame(self) -> pd.DataFrame:
        """Return the errors of free runs: a row for each recording, model and output.

        Columns: recording, part ("fit" or "held_out"), model, output, unit, rms, peak (P_V), mean (M_V),
        variance (Q_M); `model` is "uncompensated" for the readings themselves.
        """
        import pandas as pd

        results, rows = read_results(Path(self.folder)), []
        for recording in (*results["fit"], *results["held_out"]):
            part = "fit" if recording in results["fit"] else "held_out"
            seen: set[str] = set()
            for model, entry in results["models"].items():
                for output, scores in entry["recordings"].get(recording, {}).items():
                    unit = results.get("units", {}).get(output, "")
                    place = {"recording": recording, "part": part, "output": output, "unit": unit}
                    if output not in seen:
                        rows.append(place | {"model": "uncompensated"} | _scores(scores["uncompensated"]))
                        seen.add(output)
                    rows.append(place | {"model": model} | _scores(scores))
        return pd.DataFrame(rows, columns=["recording", "part", "model", "output", "unit", *CRITERIA])

    def plot(self, recording: str | None = None) -> Figure:
        """Plot readings and predictions of a recording, with a panel for each output.

        Args:
            recording: default the first held-out one.

        Raises:
            UserError: no such recording.
        """
        from matplotlib.figure import Figure

        from discovery.report.run import load_run

        run = load_run(Path(self.folder))
        name = recording or run.recordings[0]
        data = Named("recording", run.predictions)[name]
        outputs = list(data.readings)
        figure = Figure(figsize=(8, 2.2 * len(outputs)), layout="constrained")
        for axes, output in zip(figure.subplots(len(outputs), squeeze=False)[:, 0], outputs, strict=True):
            axes.plot(data.time / 3600, data.readings[output], ".", color="0.6", ms=3, label="measured")
            for model, curves in data.models.items():
                if output in curves:
                    axes.plot(data.time / 3600, curves[output], lw=1.2, label=model)
            axes.set_ylabel(f"{output} [{run.unit(output)}]")
        axes.set_xlabel("time [h]")
        figure.axes[0].set_title(f"{name} ({'held out' if name in run.held_out else 'fitted'})")
        figure.axes[0].legend(fontsize="small", loc="best")
        return figure

    def _repr_html_(self) -> str:
        frame = self.to_frame()
        table = frame.pivot_table("rms", ["recording", "part", "model"], "output", sort=False)
        return (
            f"<p>rms of free runs; the report: <code>{escape(str(self.report))}</code></p>"
            f"{table.to_html(float_format='{:.3g}'.format)}"
        )


def run(experiment: Path | str, out: Path | str | None = None) -> RunResults:
    """Run an experiment file, as `discovery run` does: fit, discover, compare, diagnose, report.

    Args:
        experiment: the experiment file.
        out: folder for the results; default runs/<experiment name>.

    Raises:
        UserError: a mistake in a file, or a model that cannot be fitted.
    """
    from discovery.experiment import run as run_experiment

    return RunResults(run_experiment(Path(experiment), None if out is None else Path(out)))


def _scores(one: dict[str, Any]) -> dict[str, float]:
    return {key: one[key] for key in CRITERIA}
