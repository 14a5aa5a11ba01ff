"""Section 2 of the paper: figures 2 and 3, wet against dry; E_X0C, which symmetry keeps small."""

from __future__ import annotations

import numpy as np

from discovery.evaluation.settling import settling
from discovery.evaluation.symmetry import symmetry
from discovery.evaluation.tables import Table
from discovery.fitting import predict_recording
from discovery.paper.active import AXIS_UM
from discovery.paper.chapter import Chapter, Material
from discovery.report.chart import Chart, Panel, Series

WARM_UP_H = 15.0  # figure 3: then the table stands still
_INSTANTS_MIN = (0.0, 60.0, 240.0)  # figure 2


def figure_2(m: Material) -> Chapter | None:
    """Body temperatures of the thermobalance, wet and dry, at the instants of the thermography."""
    fitted = m.fitted[m.form.thermobalance]
    rows: list[tuple[str | float | None, ...]] = []
    last: dict[str, dict[str, float]] = {}
    for label, recording in (("dry", m.form.dry), ("wet", m.form.wet)):
        if recording is None:
            continue
        outputs = fitted.fit.problem.outputs
        run = predict_recording(
            fitted.model, m.experiment.campaign, recording, outputs, fitted.fit.noise.white
        )
        time = run.system.grid.time / 60.0
        for k, name in enumerate(run.system.states):
            if run.system.model.states[name].capacity:
                found = [float(np.interp(t, time - time[0], run.x[:, k])) for t in _INSTANTS_MIN]
                rows.append((name, label, *found))
                last.setdefault(name, {})[label] = found[-1]
    if not rows:
        return None
    rows.sort(key=lambda row: str(row[0]))
    both = {name: one for name, one in last.items() if len(one) == 2}
    warmer = [name for name, one in both.items() if one["wet"] > one["dry"]]
    named = ", ".join(warmer) or "none"
    shows = f"At 240 min {len(warmer)} of {len(both)} bodies are warmer wet than dry: {named}."
    header = ("Body [°C]", "", *(f"{t:.0f} min" for t in _INSTANTS_MIN))
    return Chapter(
        "figure-2",
        "Figure 2: temperatures of the table, dry and wet, at 600 rpm",
        "Infrared images at 0, 60 and 240 min: with cutting fluid the C axis and the B-axis corpus "
        "become warmer.",
        (Table("Body temperatures of the fitted thermobalance", header, tuple(rows)),),
        shows=(shows,) if both else (),
        not_shown=(
            "No infrared image: these are states of the fitted model, known only through what they do to "
            "the errors.",
        ),
    )


def figure_3(m: Material) -> Chapter | None:
    """Warm-up and cool-down, wet and dry: errors, time constants, settling times."""
    phases = [(label, r) for label, r in (("dry", m.form.dry), ("wet", m.form.wet)) if r]
    if not phases:
        return None
    rows: list[tuple[str | float | None, ...]] = []
    found: dict[tuple[str, str], tuple[float, float]] = {}
    charts = []
    still = (m.form.symmetric,) if m.form.symmetric else ()  # it has no warm-up to speak of
    for error in (*m.errors, *still):
        curves = []
        for index, (label, recording) in enumerate(phases):
            time, values = m.read(recording, error)
            time = time - time[0]
            curves.append(Series(label, time / 3600.0, values, "line", str(index)))
            if error in still:
                continue
            for phase, chosen in (
                ("warm-up", time <= WARM_UP_H * 3600),
                ("cool-down", time > WARM_UP_H * 3600),
            ):
                one = settling(time[chosen], values[chosen])
                if one is None:
                    rows.append((error, f"{label}, {phase}", None, None, None, None, None))
                    continue
                settled = one.settled_h if np.isfinite(one.settled_h) else None
                rows.append(
                    (error, f"{label}, {phase}", one.change, one.tau_h, one.tau_sd, settled, one.largest)
                )
                if phase == "warm-up":
                    found[label, error] = (one.largest, one.settled_h)
        panel = Panel(f"{error} [{m.unit(error)}]", tuple(curves), zero=True)
        charts.append(
            Chart(
                f"figure-3-{error}", f"{error}, dry and wet", "time [h]", (panel,), marks={"stop": WARM_UP_H}
            )
        )
    pairs = [e for e in m.errors if ("dry", e) in found and ("wet", e) in found]
    larger = [e for e in pairs if found["wet", e][0] > found["dry", e][0]]
    slower = [e for e in pairs if not found["wet", e][1] <= found["dry", e][1]]
    shows = (
        (
            f"Wet, the error grows larger than dry in {len(larger)} of {len(pairs)} errors "
            f"({', '.join(larger) or 'none'}), "
            f"and it settles later, or not within {WARM_UP_H:g} h, in {len(slower)} "
            f"({', '.join(slower) or 'none'}).",
        )
        if pairs
        else ()
    )
    header = ("Error", "", "change", "τ [h]", "± [h]", "settled after [h]", "largest")
    return Chapter(
        "figure-3",
        "Figure 3: 15 h warm-up at 600 rpm and 10 h cool-down, dry and wet",
        "The errors are larger with cutting fluid, and the time to reach the steady state is longer.",
        (
            Table(
                "One exponential for each phase; settled: within a tenth of the change", header, tuple(rows)
            ),
        ),
        tuple(charts),
        shows,
        (
            "The paper prints curves only, no time constants, so there is none to compare with these.",
            "A single time constant summarises several bodies; an empty cell means not settled, or no change "
            "beyond the scatter of the readings.",
        ),
    )


def symmetric(m: Material) -> Chapter | None:
    """The symmetry check of E_X0C on every recording that reads it."""
    error = m.form.symmetric
    if error is None:
        return None
    rows: list[tuple[str | float | None, ...]] = []
    broken = []
    for recording, data in m.experiment.campaign.recordings.items():
        if error not in data.values:
            continue
        others = {name: data.values[name] for name in m.errors if name in data.values}
        one = symmetry(data.values[error], others)
        if one is None:
            continue
        rows.append(
            (
                recording,
                "kept" if one.kept(AXIS_UM) else "broken",
                one.rms,
                one.peak,
                one.noise,
                one.slow,
                one.correlation,
            )
        )
        broken += [] if one.kept(AXIS_UM) else [recording]
    if not rows:
        return None
    says = (
        f"Beyond reading noise, {error} moves by more than the axis resolution of {AXIS_UM:g} µm in: "
        f"{', '.join(broken)}."
        if broken
        else f"Beyond reading noise, {error} stays below the axis resolution of {AXIS_UM:g} µm in all "
        "recordings."
    )
    header = ("Recording", "symmetry", "rms", "peak", "reading noise", "slow part", "correlation")
    return Chapter(
        "symmetry",
        f"{error}: the symmetry check",
        "E_X0C is small and in the range of the axis resolution of 1 µm, because the table is symmetric "
        "about "
        "the Y-Z plane; it is not compensated.",
        (
            Table(
                f"{error} [µm]; correlation: with the other error that it is most alike", header, tuple(rows)
            ),
        ),
        shows=(says,),
        not_shown=("Which side is heated: the sign of the slow part says so only for a known mounting.",),
    )
