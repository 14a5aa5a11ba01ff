"""A logger that writes a value only when it has changed leaves no gaps; another one does."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.check import check_campaign

Array = NDArray[np.float64]
TIME = np.arange(0.0, 36000.0, 30.0)
POWER = np.where((TIME > 8000) & (TIME < 20000), 900.0, 0.0)
AIR = 21.0 + np.sin(TIME / 9000.0)
HEAD = 21.0 + np.convolve(POWER / 900.0, np.exp(-TIME / 3000.0))[: TIME.size] * 0.1


def changed(column: Array, band: float) -> Array:
    """Values where they differ from the last one written by more than a band."""
    found, last = np.full(column.size, np.nan), np.inf
    for k, value in enumerate(column):
        if abs(value - last) > band:
            found[k] = last = value
    return found


COLUMNS = {"P": (POWER, 5.0), "T_env": (AIR, 0.1), "T_head": (HEAD, 0.2), "E_z": (8.0 * HEAD, 1.0)}
ROLES = {
    "P": ("heat load", "W"),
    "T_env": ("ambient temperature", "degC"),
    "T_head": ("other input", "degC"),
    "E_z": ("error", "um"),
}


def check(folder: Path, columns: dict[str, Array]) -> list[str]:
    rows = [",".join(["time", *columns])]
    for k, time in enumerate(TIME):
        cells = ["" if np.isnan(column[k]) else f"{column[k]:g}" for column in columns.values()]
        if any(cells):
            rows.append(",".join([f"{time:g}", *cells]))
    (folder / "run.csv").write_text("\n".join(rows) + "\n")
    channels = "\n".join(f'{n} = {{ role = "{ROLES[n][0]}", unit = "{ROLES[n][1]}" }}' for n in columns)
    text = f'name = "x"\n[channels]\n{channels}\n[recordings]\nrun = {{ file = "run.csv" }}\n'
    (folder / "campaign.toml").write_text(text)
    return [finding.what for finding in check_campaign(folder)]


def test_an_empty_cell_means_unchanged(tmp_path: Path) -> None:
    found = check(tmp_path, {name: changed(*of) for name, of in COLUMNS.items()})
    assert not [
        what for what in found if "is empty for" in what or "jumps by" in what or "not known at" in what
    ]


@pytest.mark.parametrize("every", [1, 5])
def test_a_sensor_that_failed_for_hours_is_a_gap(tmp_path: Path, every: int) -> None:
    columns = {name: column.copy() for name, (column, _) in COLUMNS.items()}
    columns["T_head"][400:900] = np.nan
    for name in ("T_env", "T_head", "E_z"):
        columns[name][np.arange(TIME.size) % every > 0] = np.nan  # read together, less often
    found = check(tmp_path, columns)
    assert any("the input 'T_head' is empty for" in what for what in found)


def test_an_input_without_any_value_is_an_error(tmp_path: Path) -> None:
    columns = {name: changed(*of) for name, of in COLUMNS.items()} | {"P": np.full(TIME.size, np.nan)}
    assert "the input 'P' has no value at all" in check(tmp_path, columns)
