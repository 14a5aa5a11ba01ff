"""Files of more rows than are kept one by one: what their means hold, against the rows themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from discovery.errors import UserError
from discovery.recordings import load_campaign, longfile, quick
from discovery.recordings.campaign import Recording
from discovery.recordings.check import check_campaign

CAMPAIGN = """
name = "long"
[channels]
T_env = { role = "ambient temperature", unit = "degC" }
P     = { role = "heat load", unit = "kW" }
pump  = { role = "fluid flow", unit = "1" }
E_Y   = { role = "error", unit = "mm", noise = 0.0005 }
E_Z   = { role = "error", unit = "um" }
fix   = { role = "applied correction", unit = "mm", corrects = "E_Y" }
[recordings]
a = { file = "FILE" }
"""
ROWS = 70_001


@pytest.fixture
def frame(monkeypatch: pytest.MonkeyPatch) -> pd.DataFrame:
    """Power and correction of every row, a pump that is written when it switches, one error now and then."""
    for module in (longfile, quick):
        monkeypatch.setattr(module, "LONG", 2**12)
        monkeypatch.setattr(module, "PIECE", 3000)
    monkeypatch.setattr(longfile, "BLOCKS", 2**10)
    monkeypatch.setattr("discovery.limits.LARGE", 1000)
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.5, 1.5, ROWS))
    pump = np.full(ROWS, np.nan)
    pump[::6000] = np.arange(len(pump[::6000])) % 2
    rare = np.full(ROWS, np.nan)
    rare[100::700] = rng.normal(0.0, 5.0, len(rare[100::700]))
    return pd.DataFrame(
        {
            "time": time,
            "T_env": 22.0 + np.sin(time / 9000.0),
            "P": np.abs(rng.normal(1.0, 0.4, ROWS)),
            "pump": pump,
            "E_Y": np.where(rng.random(ROWS) < 0.9, rng.normal(0.01, 0.001, ROWS), np.nan),
            "E_Z": rare,
            "fix": np.round(np.sin(time / 3000.0), 2) * 1e-3,
        }
    )


def loaded(folder: Path, frame: pd.DataFrame, file: str) -> Recording:
    (folder / "campaign.toml").write_text(CAMPAIGN.replace("FILE", file))
    if file.endswith(".parquet"):
        frame.to_parquet(folder / file, index=False)
    else:
        frame.to_csv(folder / file, index=False)
    return load_campaign(folder).recordings["a"]


@pytest.mark.parametrize("file", ["a.parquet", "a.csv", "a.csv.gz"])
def test_nothing_of_a_long_file_is_lost(tmp_path: Path, frame: pd.DataFrame, file: str) -> None:
    one = loaded(tmp_path, frame, file)
    assert len(one.time) < ROWS / 3
    time = frame["time"].to_numpy() - frame["time"][0]
    error = 1000.0 * (frame["E_Y"] + frame["fix"]).to_numpy()  # as it were without compensation, um
    read = one.counts["E_Y"] > 0
    assert one.counts["E_Y"].sum() == np.isfinite(error).sum()
    assert np.sum(one.counts["E_Y"][read] * one.values["E_Y"][read]) == pytest.approx(np.nansum(error))
    assert np.sum(one.counts["E_Y"] * one.time) == pytest.approx(time[np.isfinite(error)].sum())
    rare = np.isfinite(frame["E_Z"].to_numpy())
    assert set(one.counts["E_Z"]) == {0.0, 1.0}
    seen = np.isfinite(one.values["E_Z"])
    assert one.time[seen] == pytest.approx(time[rare])
    assert one.values["E_Z"][seen] == pytest.approx(frame["E_Z"].to_numpy()[rare])


@pytest.mark.parametrize("file", ["a.parquet", "a.csv", "a.csv.gz"])
def test_rows_of_a_long_file_that_come_again_count_once(
    tmp_path: Path, frame: pd.DataFrame, file: str
) -> None:
    one = loaded(tmp_path, frame, file)
    again = pd.concat([frame[:20_000], frame[19_000:19_500], frame[20_000:]])
    (tmp_path / "again").mkdir()
    other = loaded(tmp_path / "again", again, file)
    assert other.time == pytest.approx(one.time, abs=1e-9)
    for name, values in one.values.items():
        assert other.values[name] == pytest.approx(values, abs=1e-9, nan_ok=True)
    said = [str(finding) for finding in check_campaign(tmp_path / "again")]
    assert any("500 rows repeat an earlier row, stamp and values; they are left out" in line for line in said)
    again.iloc[20_100, 1] = 99.0
    with pytest.raises(UserError, match="time"):
        loaded(tmp_path / "again", again, file)


@pytest.mark.parametrize("name", ["P", "pump"])
def test_held_channels_keep_their_integral(tmp_path: Path, frame: pd.DataFrame, name: str) -> None:
    one = loaded(tmp_path, frame, "a.parquet")
    known = np.isfinite(one.values[name])
    edges = np.append(one.time[known], one.time[-1])
    found = np.concatenate([[0.0], np.cumsum(one.values[name][known] * np.diff(edges))])
    time = frame["time"].to_numpy() - frame["time"][0]
    series = frame[name].ffill().to_numpy() * (1000.0 if name == "P" else 1.0)
    true = np.concatenate([[0.0], np.cumsum(series[:-1] * np.diff(time))])
    assert found == pytest.approx(np.interp(edges, time, true), rel=1e-9, abs=1e-6)
    if name == "pump":
        assert {0.0, 1.0} <= set(np.unique(one.values["pump"][known]))


def test_stamps_may_be_instants(tmp_path: Path, frame: pd.DataFrame) -> None:
    seconds = loaded(tmp_path, frame, "a.csv")
    zone = pd.Timestamp("2026-03-01T08:00:00", tz="UTC")
    stamps = (zone + pd.to_timedelta((frame["time"] * 1e6).round(), unit="us")).dt
    written = frame.assign(time=stamps.strftime("%Y-%m-%dT%H:%M:%S.%f") + "+00:00")
    (tmp_path / "b").mkdir()
    one = loaded(tmp_path / "b", written, "a.csv")
    assert one.origin is not None
    assert one.origin.startswith("2026-03-01T08:00:0")
    assert one.time == pytest.approx(seconds.time, abs=2e-6)
    assert one.values["E_Y"] == pytest.approx(seconds.values["E_Y"], nan_ok=True)


def test_a_long_file_whose_time_runs_backwards_is_refused(tmp_path: Path, frame: pd.DataFrame) -> None:
    frame.loc[50_000, "time"] = 0.0
    with pytest.raises(UserError, match=r"time does not run forward at row 50001"):
        loaded(tmp_path, frame, "a.parquet")


def test_lone_faults_are_taken_out_and_told(tmp_path: Path, frame: pd.DataFrame) -> None:
    frame.loc[[20_000, 40_000], "T_env"] = 900.0
    one = loaded(tmp_path, frame, "a.parquet")
    assert np.nanmax(one.values["T_env"]) < 24.0
    told = [f.sentence for f in check_campaign(tmp_path)]
    assert any("2 lone values of 'T_env'" in line for line in told)
