"""SysIdentPy on the systems of `sparse_systems.py`: NARX models whose terms FROLS chooses.

    python benchmarks/sparse_systems.py write 100 FOLDER
    python benchmarks/sparse_sysidentpy.py FOLDER   # in an environment of its own: it wants an older numpy

A user of SysIdentPy would put the readings on equal steps (10 min here), try 1 to 3 lags and two criteria for
the number of terms, and take what predicts the second recording best in a free run.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import time as clock
import warnings
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

STEP = 600.0  # s, a middle distance of two readings
LAGS = (1, 2, 3)
CRITERIA = ("aic", "bic")


def rastered(path: Path, output: str, outputs: list[str]) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Inputs (T, U) averaged over each step, the output (T, 1) read straight between readings, names."""
    table = pd.read_csv(path, index_col="time")
    inputs = [c for c in table if c not in outputs]
    time = np.arange(0.0, table.index[-1], STEP)
    known = table[output].dropna()
    means = table[inputs].groupby((table.index // STEP).astype(int)).mean().to_numpy()[: len(time)]
    return means, np.interp(time, known.index, known)[:, None], inputs


def free_run(model: FROLS, u: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Prediction from the first readings alone; infinite where it runs away."""
    lag = model.max_lag
    with np.errstate(all="ignore"):
        found = model.predict(X=u, y=y[:lag]).ravel()
    return np.where(np.isfinite(found), found, np.inf)


def fitted(u: np.ndarray, y: np.ndarray, lag: int, criterion: str) -> FROLS:
    """A NARX model with equal lags of the output and of each input."""
    model = FROLS(
        order_selection=True,
        n_info_values=min(15, lag * (1 + u.shape[1]) + 1),
        info_criteria=criterion,
        ylag=lag,
        xlag=[list(range(1, lag + 1))] * u.shape[1],
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=1),
    )
    model.fit(X=u, y=y)
    return model


def used_inputs(model: FROLS, inputs: list[str]) -> set[str]:
    """Inputs that appear in a term: a regressor code of n thousands is input n - 1."""
    codes = model.final_model.ravel() // 1000
    return {inputs[int(c) - 2] for c in codes if c >= 2}


def main(folder: Path) -> None:
    same = outputs = terms = 0
    left: list[float] = []
    began = clock.process_time()
    for path in sorted(folder.glob("*.json"), key=lambda one: int(one.stem)):
        truth = json.loads(path.read_text())
        for output, masses in truth.items():
            data = {
                name: rastered(folder / f"{path.stem}_{name}.csv", output, list(truth))
                for name in ("a", "b", "unseen")
            }
            u, y, inputs = data["a"]
            best, least = None, np.inf
            for lag, criterion in product(LAGS, CRITERIA):
                model = fitted(u, y, lag, criterion)
                off = data["b"][1].ravel() - free_run(model, *data["b"][:2])
                if np.sqrt(np.mean(off**2)) < least:
                    best, least = model, float(np.sqrt(np.mean(off**2)))
            outputs += 1
            if best is None:
                left.append(np.inf)
                continue
            same += used_inputs(best, inputs) == {m["drive"] for m in masses}
            terms += len(best.final_model)
            predicted = free_run(best, *data["unseen"][:2])
            read = pd.read_csv(folder / f"{path.stem}_unseen.csv", index_col="time")[output].dropna()
            time = STEP * np.arange(len(predicted))
            left.append(
                float(np.sqrt(np.mean((read - np.interp(read.index.to_numpy(), time, predicted)) ** 2)))
            )
        print(
            f"{int(path.stem) + 1} systems: same inputs in {same} of {outputs} outputs, "
            f"{terms / outputs:.1f} terms an output, median rms held out {np.median(left):.2f} um, "
            f"{(clock.process_time() - began) / outputs:.1f} s an output",
            flush=True,
        )


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    with contextlib.redirect_stderr(io.StringIO()):
        main(Path(sys.argv[1]))
