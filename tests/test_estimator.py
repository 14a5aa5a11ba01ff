"""Discovery from Python, on frames and arrays: scikit-learn's tools work with it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pysindy
import pytest
from pysindy.optimizers import BaseOptimizer
from sklearn.base import clone
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit

import discovery
from discovery import SparseDiscovery, UserError, discover

STEP = 120.0
CHANNELS = {
    "P": {"role": "heat load", "unit": "W"},
    "Q": {"role": "heat load", "unit": "W"},
    "E": {"role": "error", "unit": "um"},
}


def frame(seed: int, count: int = 900) -> pd.DataFrame:
    """A mass of 3600 s and 0.02 um/W behind P; Q does nothing; 0.1 um noise."""
    rng = np.random.default_rng(seed)
    loads = [np.repeat(rng.choice([0.0, 100.0, 250.0], count // 30 + 1), 30)[:count] for _ in range(2)]
    decay, s, seen = np.exp(-STEP / 3600), 0.0, []
    for p in loads[0]:
        seen.append(s)
        s = 0.02 * p + decay * (s - 0.02 * p)
    noise = 0.1 * rng.standard_normal(count)
    return pd.DataFrame(
        {"P": loads[0], "Q": loads[1], "E": np.array(seen) + noise}, index=STEP * np.arange(count)
    )


@pytest.fixture(scope="module")
def found() -> SparseDiscovery:
    return discover({"a": frame(0), "b": frame(1)}, ["E"], CHANNELS, form="masses")


def test_frames_give_the_mass_with_intervals_that_hold_the_truth(found: SparseDiscovery) -> None:
    table = found.coefficients()
    assert found.discovery_.report["groups"][0]["kept"][0].startswith("lag(P")
    assert len(table) == 2
    for truth, unit in ((3600.0, "s"), (0.02, "um/W")):
        (row,) = [row for _, row in table.iterrows() if row["unit"] == unit]
        assert row["low"] < truth < row["high"]
        assert row["value"] == pytest.approx(truth, rel=0.03)


def test_a_second_mass_slower_than_the_recording_does_not_take_the_first_one_along() -> None:
    """A lag of 1500 s, and one of 60 h that 8 h do not determine."""
    time, load = np.arange(0.0, 8 * 3600.0, 60.0), np.repeat([0.0, 2.0, 0.0, 3.0, 1.0, 0.0, 2.0, 0.0], 60)
    masses = np.zeros((len(time), 2))
    share = np.exp(-60.0 / np.array([1500.0, 216000.0]))
    for k in range(len(time) - 1):
        masses[k + 1] = load[k] + (masses[k] - load[k]) * share
    noise = 0.1 * np.random.default_rng(5).standard_normal(len(time))
    made = pd.DataFrame({"P": load, "E": masses @ [5.0, 3.0] + noise}, index=pd.Index(time, name="time"))
    numbers = discover(made, ["E"], CHANNELS, form="masses").coefficients()
    assert numbers["value"]["E_tau1"] == pytest.approx(1500.0, rel=0.05)
    (gain,) = numbers["value"].filter(like="E_gain")  # of the mass that the recording determines
    assert gain == pytest.approx(5.0, rel=0.05)


def test_it_shows_its_table_and_the_error_against_size(found: SparseDiscovery) -> None:
    assert found.to_frame().equals(found.coefficients())
    (axes,) = found.plot().axes
    left_out, _, chosen = axes.get_lines()
    path = found.discovery_.report["path"]
    assert np.sort(np.asarray(left_out.get_ydata())).tolist() == sorted(p["left_out_rms"] for p in path)
    assert np.asarray(chosen.get_xdata())[0] == next(p["terms"] for p in path if p["chosen"])


def test_free_runs_on_what_was_not_seen_leave_the_noise(found: SparseDiscovery) -> None:
    new = frame(7)
    predicted = found.predict(new[["P", "Q"]])
    assert predicted.shape == (900,)
    assert float(np.std(new["E"] - predicted)) == pytest.approx(0.1, rel=0.1)
    assert found.score(new[["P", "Q"]], new["E"]) > 0.98


def test_a_page_of_text_says_equations_numbers_and_costs(found: SparseDiscovery) -> None:
    page = found.summary()
    assert found.equations()[0] in page
    assert "um/W" in page
    assert "lag(P" in page


def test_clone_and_grid_search_work_on_arrays() -> None:
    both = frame(3, 600)
    x, y = both[["P", "Q"]].to_numpy(), both["E"].to_numpy()
    bare = SparseDiscovery(step=STEP, form="masses", channels={"y0": CHANNELS["E"]})
    assert clone(bare).get_params() == bare.get_params()
    search = GridSearchCV(bare, {"max_terms": [1, 3]}, cv=TimeSeriesSplit(2), error_score="raise")
    search.fit(x, y)
    assert search.best_score_ > 0.9
    assert search.predict(x).shape == y.shape


def test_an_optimiser_of_pysindy_is_taken_as_it_is() -> None:
    """Named or given as an object, the same optimiser finds the same model."""
    given, named = (
        discover({"a": frame(0, 300)}, ["E"], CHANNELS, form="masses", max_terms=3, **options)
        for options in (
            {"optimiser": pysindy.STLSQ(threshold=0.05)},
            {"optimiser": "pysindy:STLSQ", "optimiser_arguments": {"threshold": 0.05}},
        )
    )
    assert given.equations() == named.equations()
    assert "P" in "".join(given.equations())


class Cut(BaseOptimizer):  # type: ignore[misc]
    """An optimiser of a user: least squares, small coefficients cut off."""

    def _reduce(self, x: np.ndarray, y: np.ndarray) -> None:
        found = np.linalg.lstsq(x, y, rcond=None)[0].T
        self.coef_ = np.where(np.abs(found) < 0.05, 0.0, found)
        self.ind_ = self.coef_ != 0


def test_an_optimiser_of_a_user_is_taken() -> None:
    found = discover({"a": frame(0, 300)}, ["E"], CHANNELS, form="masses", max_terms=3, optimiser=Cut())
    assert "P" in "".join(found.equations())


def test_mistakes_are_one_sentence() -> None:
    one = frame(0, 100)
    with pytest.raises(UserError, match="no column 'F'"):
        discover(one, ["F"])
    with pytest.raises(UserError, match="max_terms"):
        discover(one, ["E"], max_terms=0)
    with pytest.raises(UserError, match="no option 'libary'; did you mean 'library'"):
        discover(one, ["E"], libary=["linear"])
    with pytest.raises(UserError, match=r"Ridge\(\) is not an optimiser of PySINDy"):
        discover(one, ["E"], optimiser=Ridge())
    with pytest.raises(UserError, match="as texts, as in"):
        discover(one, ["E"], library=pysindy.PolynomialLibrary(2))
    with pytest.raises(UserError, match="100 rows"):
        SparseDiscovery().fit(one[["P"]], one["E"][:50])
    with pytest.raises(UserError, match="no frame"):
        discovery.discover({}, ["E"])
