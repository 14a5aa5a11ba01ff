"""The criteria and tables of the paper."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from discovery.evaluation import Criteria, criteria, evaluate, improvement
from discovery.evaluation.paper import TABLE_3
from discovery.evaluation.tables import as_text, table_1, table_3


def test_criteria_against_numpy() -> None:
    rng = np.random.default_rng(0)
    e = rng.normal(-3.0, 2.0, 200)
    found = criteria(np.concatenate([e, [np.nan] * 7]))
    assert found.peak == np.max(np.abs(e))
    assert found.mean == pytest.approx(np.mean(e))
    assert found.variance == pytest.approx(np.var(e))
    assert found.rms == pytest.approx(math.sqrt(np.var(e) + np.mean(e) ** 2))


def test_r2_against_sklearn() -> None:
    from sklearn.metrics import r2_score

    rng = np.random.default_rng(1)
    reading = rng.normal(5.0, 2.0, 100)
    prediction = reading + rng.normal(0.0, 0.5, 100)
    assert evaluate(reading, prediction)["r2"] == pytest.approx(r2_score(reading, prediction))


@pytest.mark.parametrize("error", TABLE_3)
@pytest.mark.parametrize("equation", ["8", "9"])
def test_improvements_are_those_that_the_paper_prints(error: str, equation: str) -> None:
    """The paper computed its percentages from unrounded figures: they agree to the rounding of what it
    prints.
    """
    before, after, printed = (TABLE_3[error][key] for key in ("uncompensated", equation, f"{equation} %"))
    found = improvement(Criteria(1.0, *before), Criteria(1.0, *after))
    for key, value in zip(("peak", "mean", "variance"), printed, strict=True):
        assert found[key] == pytest.approx(value, abs=4.0), key


def test_a_perfect_model_and_none() -> None:
    reading = np.array([3.0, -1.0, np.nan, 2.0])
    perfect = evaluate(reading, reading)
    assert perfect["improvement"] == {"rms": 100.0, "peak": 100.0, "mean": 100.0, "variance": 100.0}
    assert perfect["r2"] == 1.0
    nothing = evaluate(reading, np.zeros(4))
    assert nothing["improvement"] == dict.fromkeys(("rms", "peak", "mean", "variance"), 0.0)


def test_a_temperature_is_compared_with_its_first_reading() -> None:
    entry = evaluate(np.array([20.0, 24.0]), np.array([20.0, 23.0]), reference=20.0)
    assert entry["uncompensated"]["peak"] == 4.0
    assert entry["improvement"]["peak"] == 75.0


def test_nothing_read_is_no_number() -> None:
    entry = evaluate(np.full(3, np.nan), np.zeros(3))
    assert math.isnan(entry["rms"])
    assert math.isnan(entry["improvement"]["rms"])


def test_where_nothing_was_wrong_no_percentage_improves() -> None:
    found = improvement(Criteria(2.0, 4.0, 0.0, 4.0), Criteria(1.0, 5.0, 1.0, 1.0))
    assert math.isnan(found.pop("mean"))
    assert found == pytest.approx({"rms": 50.0, "peak": -25.0, "variance": 75.0})


def results() -> dict[str, Any]:
    reading = np.array([-49.0, -30.0, -26.0])
    entry = evaluate(reading, reading * 0.9)
    return {
        "models": {
            "reduced": {"kind": "reduced", "recordings": {"fit": {"E_Y0C": entry}, "left": {"E_Y0C": entry}}},
            "mine": {"kind": "file", "recordings": {"left": {"E_Y0C": entry, "T1": entry}}},
        }
    }


def test_table_3_has_the_papers_figures_beside_ours() -> None:
    table = table_3(results(), "left")
    assert table.header == ("Error", "", "P_V", "paper", "M_V", "paper", "Q_M", "paper", "rms")
    rows = {row[:2]: row[2:] for row in table.rows}
    assert rows["E_Y0C", "uncompensated"][:4] == (49.0, 49, -35.0, -35)
    assert rows["E_Y0C", "reduced"][1::2][:3] == (16, 6, 6)
    assert list(rows["E_Y0C", "improvement reduced [%]"][:2]) == pytest.approx([90.0, 69])
    assert rows["E_Y0C", "mine"][1] is None
    assert rows["T1", "uncompensated"][1] is None


def test_a_table_names_only_the_models_that_ran_on_a_recording() -> None:
    assert {row[1] for row in table_3(results(), "fit").rows} == {
        "uncompensated",
        "reduced",
        "improvement reduced [%]",
    }


def test_table_1_has_a_column_for_each_part() -> None:
    table = table_1(results(), "reduced", {"test cycle": "fit", "left side": "left"})
    assert table.header == (
        "Error",
        "test cycle (fit)",
        "paper",
        "2. test cycle",
        "paper",
        "left side (left)",
        "paper",
    )
    [row] = table.rows
    assert row[0] == "E_Y0C"
    assert [row[1], row[5]] == pytest.approx([90.0, 90.0])
    assert (row[2], row[3], row[4], row[6]) == (85.5, None, 86.7, 92.7)


def test_a_table_as_text_lines_up() -> None:
    lines = as_text(table_3(results(), "left")).splitlines()
    assert lines[0] == "Recording 'left' (Table 3)"
    assert all(len(line) <= len(lines[1]) for line in lines[2:])
