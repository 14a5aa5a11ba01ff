"""Loading: what stands in the files arrives, in canonical units, at its own instants."""

import gzip
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from discovery.errors import UserError
from discovery.recordings import Channel, Recording, load_campaign, sample_input
from tests.recordings.conftest import CAMPAIGN, Write, rows


def test_values_and_empty_cells(write: Write) -> None:
    campaign = load_campaign(write())
    fit = campaign.recordings["fit"]
    assert fit.time.tolist() == [60.0 * i for i in range(60)]
    assert fit.values["speed"].tolist() == [600.0] * 30 + [0.0] * 30
    assert np.isnan(fit.values["E_Y0C"]).tolist() == [False, True] * 30
    assert fit.values["E_Y0C"][2] == 0.6
    assert (fit.start, fit.origin, fit.note) == (0.0, None, "")
    assert campaign.channels["E_Y0C"] == Channel("E_Y0C", "error", "um", 0.5, "held")
    assert campaign.channels["T_env"].between == "linear"


def test_units_of_values_noise_and_constants(write: Write) -> None:
    text = CAMPAIGN.replace('"degC" }', '"degF" }').replace('"um", noise = 0.5', '"mm", noise = 0.001')
    text = text.replace('"rpm" }', '"Hz", between = "linear" }').replace(
        '"fit.csv" }', '"fit.csv", set = { T_env = 68 } }'
    )
    campaign = load_campaign(write(campaign=text))
    fit = campaign.recordings["fit"]
    assert fit.values["T_env"] == pytest.approx(20.0)
    assert fit.values["speed"][0] == pytest.approx(36000.0)
    assert fit.values["E_Y0C"][2] == pytest.approx(600.0)
    assert campaign.channels["E_Y0C"].noise == pytest.approx(1.0)
    assert campaign.channels["E_Y0C"].unit == "um"
    assert campaign.channels["speed"].between == "linear"


def test_a_noise_is_a_difference_of_temperatures(write: Write) -> None:
    campaign = load_campaign(write(campaign=CAMPAIGN.replace('"degC"', '"degF", noise = 0.9')))
    assert campaign.channels["T_env"].noise == pytest.approx(0.5)


@pytest.mark.parametrize(("unit", "spread"), [("degC", 1.8), ("K", 1.8), ("degF", 1.0)])
def test_a_spread_is_a_difference_of_temperatures(write: Write, unit: str, spread: float) -> None:
    campaign = load_campaign(write(campaign=CAMPAIGN.replace('"degC"', f'"{unit}", spread = 1.8')))
    assert campaign.channels["T_env"].spread == pytest.approx(spread)
    assert campaign.channels["speed"].spread == 0.0


@pytest.mark.parametrize("packed", [False, True])
def test_gzip_byte_order_mark_and_windows_line_ends(write: Write, packed: bool) -> None:
    data = b"\xef\xbb\xbf" + "\r\n".join(rows()).encode()
    campaign = load_campaign(
        write(gzip.compress(data) if packed else data, name="fit.csv.gz" if packed else "fit.csv")
    )
    assert campaign.recordings["fit"].time.size == 60


def test_instants(write: Write) -> None:
    lines = rows()
    for i in range(1, 61):
        stamp = f"2026-03-29T0{(i - 1) // 60}:{(i - 1) % 60:02d}:00.500+01:00"
        lines[i] = stamp + lines[i][lines[i].index(",") :]
    fit = load_campaign(write(lines)).recordings["fit"]
    assert fit.time.tolist() == [60.0 * i for i in range(60)]
    assert fit.origin == "2026-03-29T00:00:00.500000+01:00"
    assert fit.start == 0.0


def test_seconds_keep_their_clock(write: Write) -> None:
    lines = [rows()[0], "2.5,20,0,1", "7.5,20,0,", "13.0,20,0,2"]
    fit = load_campaign(write(lines)).recordings["fit"]
    assert fit.time.tolist() == [0.0, 5.0, 10.5]
    assert fit.start == 2.5


@pytest.mark.parametrize("stamps", ["seconds", "instants", "zoned"])
def test_parquet_holds_the_same(write: Write, tmp_path: Path, stamps: str) -> None:
    zone = UTC if stamps == "zoned" else None
    instants = [datetime(2026, 3, 1, 8, 0, second, tzinfo=zone) for second in (0, 10, 25)]
    table = pa.table(
        {
            "time": [0, 10, 25] if stamps == "seconds" else instants,
            "T_env": pa.array([20.0, None, float("nan")]),
            "speed": pa.array([600, 0, None], pa.int16()),
            "E_Y0C": pa.array([None, 1.5, 2.5], pa.float32()),
        }
    )
    parquet.write_table(table, tmp_path / "fit.parquet")
    path = write((tmp_path / "fit.parquet").read_bytes(), name="fit.parquet")
    fit = load_campaign(path).recordings["fit"]
    assert fit.time.tolist() == [0.0, 10.0, 25.0]
    np.testing.assert_array_equal(fit.values["T_env"], [20.0, np.nan, np.nan])
    np.testing.assert_array_equal(fit.values["speed"], [600.0, 0.0, np.nan])
    np.testing.assert_array_equal(fit.values["E_Y0C"], [np.nan, 1.5, 2.5])
    origin = {"seconds": None, "instants": "2026-03-01T08:00:00", "zoned": "2026-03-01T08:00:00+00:00"}
    assert fit.origin == origin[stamps]


def test_the_careful_way_reads_the_same_as_the_quick_one(write: Write) -> None:
    quick = load_campaign(write()).recordings["fit"]
    quoted = [",".join(f'" {cell} "' for cell in line.split(",")) for line in rows()]
    careful = load_campaign(write("\n\n".join(quoted))).recordings["fit"]
    np.testing.assert_array_equal(quick.time, careful.time)
    for name, column in quick.values.items():
        np.testing.assert_array_equal(column, careful.values[name])


def test_a_column_may_have_another_name_in_the_files(write: Write) -> None:
    lines = rows()
    lines[0] = "time,Temp. env [°C],speed,E_Y0C"
    text = CAMPAIGN.replace('"degC" }', '"degC", column = "Temp. env [°C]" }')
    assert load_campaign(write(lines, text)).recordings["fit"].values["T_env"][1] == 20.1


def test_only_those_asked_for_are_read(write: Write) -> None:
    path = write(campaign=CAMPAIGN + 'lost = { file = "lost.csv" }\n')
    assert list(load_campaign(path, only=["fit"]).recordings) == ["fit"]
    assert list(load_campaign(path.parent, only=["fit"]).recordings) == ["fit"]
    with pytest.raises(UserError, match=r"lost\.csv: there is no such file"):
        load_campaign(path)
    with pytest.raises(UserError, match=r"no recording 'fitt'; did you mean 'fit'\? Allowed are: fit, lost"):
        load_campaign(path, only=["fitt"])


def changed(line: int, text: str) -> list[str]:
    lines = rows()
    lines[line - 1] = text
    return lines


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (changed(1, "time,T_env,speeed,E_Y0C"), "fit.csv, line 1: no column 'speed'; did you mean 'speeed'?"),
        (changed(1, "stamp,T_env,speed,E_Y0C"), "fit.csv, line 1: no column 'time'"),
        (
            changed(1, "time [min],T_env,speed,E_Y0C"),
            "'time'; it counts in s (`discovery new` converts minutes)",
        ),
        (changed(7, "300,20,abc,"), "fit.csv, line 7: 'speed' is 'abc', not a number"),
        (changed(7, "300,20,inf,"), "fit.csv, line 7: 'speed' is 'inf', not a number"),
        (changed(7, "100,20,0,"), "fit.csv, line 7: time runs backwards by 140 s"),
        (changed(7, "240,20,0,"), "fit.csv, line 7: the time stamp of the line before is repeated"),
        (changed(7, "soon,20,0,"), "fit.csv, line 7: the stamp 'soon' is not a number of seconds"),
        (changed(7, ",20,0,"), "fit.csv, line 7: no stamp in the column time"),
        (changed(7, "300,20"), "fit.csv, line 7: 2 cells under 4 columns; look for an incomplete line"),
        (rows()[:2], "fit.csv: only 1 row; too short"),
        ("", "fit.csv: the file is empty"),
    ],
)
def test_what_cannot_be_used_is_refused(write: Write, data: str | list[str], said: str) -> None:
    with pytest.raises(UserError) as caught:
        load_campaign(write(data))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"rpm"', '"rmp"', "line 5: channels.speed.unit: the unit 'rmp' is not known; allowed is rpm"),
        (
            "rotation speed",
            "rotation sped",
            "line 5: channels.speed.role: 'rotation sped' is not known; did you mean",
        ),
        ("noise = 0.5", "noise = -1", "line 6: channels.E_Y0C.noise: should be greater than 0, not -1"),
        ("T_env =", "T-env =", "line 4: channels.T-env: a channel's name is a word"),
        ("T_env =", "lambda =", "line 4: channels.lambda: this word has a meaning of its own"),
        ("T_env =", "time =", "line 4: channels.time: this word has a meaning of its own"),
        (
            'csv" }',
            'csv", set = { T_evn = 3 } }',
            "line 9: recordings.fit.set.T_evn: no such channel; did you mean 'T_env'",
        ),
        ("fit =", '"a/b" =', "line 9: recordings.a/b: a recording's name becomes a file name"),
    ],
)
def test_mistakes_in_the_campaign_file(write: Write, old: str, new: str, said: str) -> None:
    with pytest.raises(UserError) as caught:
        load_campaign(write(campaign=CAMPAIGN.replace(old, new)))
    assert said in str(caught.value)


def test_a_name_too_long_for_a_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        load_campaign(tmp_path / ("1" * 400 + ".toml"))


@pytest.mark.parametrize(("between", "expected"), [("held", [1, 1, 1, 5, 5]), ("linear", [1, 1, 3, 5, 5])])
def test_inputs_between_their_stamps(between: str, expected: list[float]) -> None:
    channel = Channel("x", "other input", "1", None, "linear" if between == "linear" else "held")
    time = np.array([0.0, 10.0, 15.0, 20.0, 30.0])
    recording = Recording("r", time, {"x": np.array([np.nan, 1.0, np.nan, 5.0, np.nan])})
    assert sample_input(recording, channel, [-1.0, 5.0, 15.0, 20.0, 40.0]).tolist() == expected


def test_an_input_known_nowhere_stays_unknown() -> None:
    recording = Recording("r", np.array([0.0, 1.0]), {"x": np.full(2, np.nan)})
    assert np.isnan(sample_input(recording, Channel("x", "other input", "1", None, "held"), [0.5])).all()


def test_a_campaign_of_three_days_loads_at_once(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    lines = ["time,T_env,speed,E_Y0C"]
    lines += [f"{60 * i},{20 + random.normal():.3f},600,{random.normal():.2f}" for i in range(4321)]
    text = CAMPAIGN + 'b = { file = "b.csv.gz" }\nc = { file = "c.csv.gz" }\n'
    (tmp_path / "campaign.toml").write_text(text.replace("fit.csv", "a.csv.gz"), encoding="utf-8")
    for name in "abc":
        (tmp_path / f"{name}.csv.gz").write_bytes(gzip.compress("\n".join(lines).encode()))
    load_campaign(tmp_path)  # imports
    began = time.perf_counter()
    campaign = load_campaign(tmp_path)
    assert time.perf_counter() - began < 0.3  # 0.01 s on a quiet machine
    assert [one.time.size for one in campaign.recordings.values()] == [4321] * 3
