"""The workbench and what else one would use for the same job: python -m benchmarks.side_by_side [--store]

Prints seconds of processor time, the least of several, of both, their ratio, and that they agree.
`--store` writes the ratios to benchmarks/figures.json; `python -m benchmarks.compare` holds new ones against
them. Ratios on one machine say the same on another; seconds do not.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

Array = NDArray[np.float64]
FIGURES = Path(__file__).with_name("figures.json")


class Pair(NamedTuple):
    """Seconds of ours and of the other, and how far their answers are apart."""

    job: str
    other: str
    ours: float
    theirs: float
    apart: str

    @property
    def ratio(self) -> float:
        return self.theirs / self.ours


def least(work: Callable[[], object], times: int) -> float:
    """The least seconds of processor time of some attempts."""
    found = []
    for _ in range(times):
        began = time.process_time()
        work()
        found.append(time.process_time() - began)
    return min(found)


def free_run() -> Pair:
    """72 h of the five-body thermobalance of the machine, inputs every minute, a reading every hour."""
    from discovery.dynamics import make_grid, make_system, predict, simulate
    from discovery.models.thermobalance import thermobalance
    from tests.dynamics.test_against_scipy import thermobalance_by_hand, wet_day

    campaign, model = wet_day(60.0, 72.0), thermobalance()
    outputs = list(model.outputs)
    system = make_system(model, make_grid(campaign, "day", model.inputs, outputs))
    values = model.values()
    found = predict(simulate(system, values))
    ours = least(lambda: predict(simulate(system, values)), 20)
    reference: list[Array] = []
    theirs = least(lambda: reference.append(thermobalance_by_hand(campaign)[1]), 1)
    apart = float(np.abs(found - reference[0]).max())
    return Pair("free run of 72 h, five bodies", "scipy solve_ivp (LSODA)", ours, theirs, f"{apart:.1g} um")


def fit() -> Pair:
    """Three numbers and the start of a body, from one recording of two outputs."""
    import tempfile

    from discovery.fitting import fit_model
    from discovery.models import read_model
    from discovery.recordings import load_campaign
    from tests.small import write_small

    with tempfile.TemporaryDirectory() as folder:
        write_small(Path(folder))
        campaign, model = load_campaign(folder), read_model(Path(folder) / "model.toml")
    data = campaign.recordings["a"]
    outputs = ["E_Y0C", "E_R0T"]
    fitted = fit_model(model, campaign, ["a"], outputs)
    ours = least(lambda: fit_model(model, campaign, ["a"], outputs), 5)
    room, power = data.values["T_env"], data.values["P"]
    read = {name: np.isfinite(data.values[name]) for name in outputs}
    levers = {"E_Y0C": -5.0, "E_R0T": 2.0}
    known = np.isfinite(power)
    stamps, held = data.time[known], power[known]

    def residual(x: Array) -> Array:
        def rate(t: float, y: Array) -> Array:
            heat = held[np.searchsorted(stamps, t, side="right") - 1]
            return np.asarray((x[0] * (np.interp(t, data.time, room) - y) + x[1] * heat) / 60e3)

        run = solve_ivp(
            rate, (0.0, data.time[-1]), [room[0] + x[2]], t_eval=data.time, max_step=300.0, rtol=1e-6
        )
        left = [(data.values[n][read[n]] - levers[n] * (run.y[0][read[n]] - 22.0)) / 0.3 for n in outputs]
        return np.concatenate(left)

    answers: list[Array] = []
    theirs = least(
        lambda: answers.append(least_squares(residual, [10.0, 0.5, 0.0], x_scale=[10, 0.5, 1]).x), 1
    )
    found = [fitted.model.parameters[n].value for n in ("G", "loss")]
    apart = float(np.max(np.abs(np.array(found) / answers[0][:2] - 1)))
    return Pair(
        "fit of a body", "least_squares on solve_ivp", ours, theirs, f"{100 * apart:.1g} % of G, loss"
    )


def sparse_path() -> Pair:
    """The best terms of 40 candidates from 4000 readings, the size chosen by what is left out."""
    import pysindy

    from discovery.sparse.optimiser import SparseSearch

    rng = np.random.default_rng(0)
    x = rng.normal(size=(4000, 40)) @ (np.eye(40) + 0.1 * rng.normal(size=(40, 40)))
    true = np.zeros(40)
    true[[3, 11, 20, 33]] = [1.0, -0.5, 0.8, 0.3]
    y = (x @ true + 0.1 * rng.normal(size=4000))[:, None]
    ours_of = SparseSearch(noise=[0.1]).fit(x, y).coef_[0]
    ours = least(lambda: SparseSearch(noise=[0.1]).fit(x, y), 5)

    def thresholds() -> Array:
        half, best, lowest = len(x) // 2, np.zeros(40), np.inf
        for level in np.geomspace(1e-3, 2.0, 25):
            one = pysindy.STLSQ(threshold=level, alpha=1e-8).fit(x[:half], y[:half])
            cost = float(np.mean((y[half:] - x[half:] @ one.coef_.T) ** 2))
            if cost < 0.999 * lowest:
                best, lowest = one.coef_[0], cost
        return best

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs_of = thresholds()
        theirs = least(thresholds, 3)
    sets = [set(np.flatnonzero(c)) for c in (ours_of, theirs_of)]
    same = ["exact" if s == set(np.flatnonzero(true)) else f"{len(s)} terms" for s in sets]
    return Pair(
        "sparse search, 40 candidates", "PySINDy, 25 thresholds", ours, theirs, f"{same[0]}, {same[1]}"
    )


def pairs() -> list[Pair]:
    """All of them."""
    return [free_run(), fit(), sparse_path()]


def main() -> None:
    """Print the table; with `--store`, keep the ratios."""
    found = pairs()
    print("| job | ours, s | other | other, s | times as fast | answers |\n|---|---|---|---|---|---|")
    for one in found:
        print(
            f"| {one.job} | {one.ours:.2g} | {one.other} | {one.theirs:.2g} | {one.ratio:.3g} | {one.apart} |"
        )
    if "--store" in sys.argv:
        FIGURES.write_text(json.dumps({one.job: round(one.ratio, 2) for one in found}, indent=1) + "\n")


if __name__ == "__main__":
    main()
