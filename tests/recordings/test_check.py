"""`discovery check`: each trouble is found once, at its line, with what to do; whatever the file holds."""

import gzip
import io
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.recordings import load_campaign
from discovery.recordings.check import check_campaign, summary
from tests.recordings.conftest import CAMPAIGN, Write, found, rows, with_column, with_line

ROOT = Path(__file__).parents[2]


def test_nothing_is_wrong(write: Write) -> None:
    assert check_campaign(write()) == []
    assert summary([]) == "nothing is wrong with these recordings"


def test_a_meter_of_a_flow_is_noisy_around_zero(write: Write) -> None:
    flow = CAMPAIGN.replace("[recordings]", 'flow = { role = "fluid flow", unit = "l/min" }\n\n[recordings]')
    noisy = [f"{12.0 * (k // 20 % 2) - 0.2 * (k % 3 == 0):.1f}" for k in range(60)]
    data = ["time,T_env,speed,E_Y0C,flow", *(f"{a},{b}" for a, b in zip(rows()[1:], noisy, strict=True))]
    assert found(write(data, flow)) == []
    wrong = [*data[:9], data[9].rsplit(",", 1)[0] + ",-5.0", *data[10:]]
    assert any("'flow' is -5 l/min, no fluid flow can be that" in one for one in found(write(wrong, flow)))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (with_line(1, "time,T_env,speed,speed"), "error: fit.csv, line 1: 2 columns are named 'speed'"),
        (
            with_line(1, "time,T_env,sped,E_Y0C"),
            "error: fit.csv, line 1: no column 'speed'; add it, or say set",
        ),
        (with_line(1, "time,T_env,sped,E_Y0C"), "warning: fit.csv, line 1: the column 'sped' is not among"),
        (with_line(9, "100,20,0,"), "error: fit.csv, line 9: time runs backwards by 260 s; sort"),
        (
            with_line(9, "360,20,0,"),
            "error: fit.csv, line 9: the time stamp of the line before is repeated; delete",
        ),
        ([*rows(), "90000,20,0,1"], "warning: fit.csv, line 62: time jumps by 86460 s where steps are 60 s"),
        (with_line(9, "420,2O,0,"), "error: fit.csv, line 9: 'T_env' is '2O', not a number; write a number"),
        (with_line(9, '420,"20,5",0,'), "error: fit.csv, line 9: 'T_env' is '20,5' with a decimal comma"),
        (with_line(9, "420,20,5,0,"), "error: fit.csv, line 9: 5 cells under 4 columns; look for a decimal"),
        (
            with_line(9, "420,200,0,"),
            "warning: fit.csv, line 9: 'T_env' is 200 degC in one reading between 20.6 and 20.1",
        ),
        (with_line(9, "420,-300,0,"), "error: fit.csv, line 9: 'T_env' is -300 degC, no ambient temperature"),
        (with_line(9, "420,20,9e9,"), "error: fit.csv, line 9: 'speed' is 9e+09 rpm, no rotation speed can"),
        (rows(2), "error: fit.csv: only 2 rows; too short for any model"),
        (rows(10), "warning: fit.csv: 'E_Y0C' has 5 readings; record longer"),
        (with_column(3, [""] * 60), "warning: fit.csv: 'E_Y0C' has no readings; look at the sensor"),
        (
            with_column(2, [""] * 60),
            "error: fit.csv: the input 'speed' has no value at all; measure it, or say",
        ),
        (
            with_column(2, ["1"] * 10 + [""] * 40 + ["1"] * 10),
            "warning: fit.csv, line 12: the input 'speed' is empty for 2340 s, up to line 51; the value",
        ),
        (
            with_column(2, ["1"] * 10 + [""] * 40 + ["1"] * 10),
            "warning: fit.csv, line 12: 'speed' is not known at 20 of 30 readings of 'E_Y0C'",
        ),
        (
            with_column(1, [""] * 30 + [f"{20 + i % 3}" for i in range(30)]),
            "warning: fit.csv, line 2: the input 'T_env' is empty for 1740 s, up to line 31; the first known",
        ),
        (with_column(1, ["21.5"] * 60), "warning: fit.csv, line 2: 'T_env' is 21.5 in all 60 readings"),
        (
            with_column(
                1, [f"{20 + i % 7}" for i in range(40)] + ["20"] * 160 + [f"{20 + i % 7}" for i in range(40)]
            ),
            "warning: fit.csv, line 42: 'T_env' stays at 20 for 161 readings, up to line 202",
        ),
        (
            with_column(1, ["20", "20.1"] * 20 + ["-28"] + ["20.1", "20"] * 10),
            "warning: fit.csv, line 42: 'T_env' is -28 degC in one reading between 20.1 and 20.1; it "
            "is left out",
        ),
        (
            with_column(3, ["7", "", "8", ""] * 10 + ["900", ""] + ["7", "", "8", ""] * 5),
            "warning: fit.csv, line 42: 'E_Y0C' is 900 um in one reading between 8 and 7; it is left out",
        ),
        (
            "\n".join(rows()).replace(",", ";"),
            "error: fit.csv, line 1: the columns are separated by a semicolon; export it with a comma "
            "between the columns and a point in numbers, or let `discovery new` read it",
        ),
        ("\n".join(rows()).replace(",", "\t"), "error: fit.csv, line 1: the columns are separated by a tab"),
        (
            "\n".join(rows()).replace(",", ";").replace(".", ","),
            "error: fit.csv, line 2: 'T_env' is '20,0' with a decimal comma (and",
        ),
        ("\n".join(rows()).encode("utf-16"), "error: fit.csv: the text is UTF-16; save the file as UTF-8"),
        (
            "\n".join(with_line(5, "180,20 °C,0,")).encode("latin-1"),
            "error: fit.csv, line 5: not UTF-8 text (perhaps Latin-1, where the byte is '°'); save",
        ),
        (b"PK\x03\x04\0\0 no text", "error: fit.csv, line 1: a zero byte: not a text"),
        (
            gzip.compress(b"time,T_env\n" * 99, mtime=0)[:-20],
            "error: fit.csv: cannot be read (Compressed file ended before the end-of-stream marker was "
            "reached); copy or compress the file again",
        ),
        ("", "error: fit.csv: the file is empty"),
        ("time,T_env,speed,E_Y0C\n", "error: fit.csv: no row with a stamp"),
        (
            with_line(9, "2026-03-01,20,0,"),
            "error: fit.csv, line 9: the stamp '2026-03-01' is not a number of seconds; write all stamps",
        ),
    ],
)
def test_each_trouble_is_found_where_it_is(write: Write, data: str | bytes | list[str], said: str) -> None:
    told = found(write(data))
    assert any(line.startswith(said) for line in told), told


def test_stamps_of_another_form_are_the_only_trouble(write: Write) -> None:
    """Loading tells the first trouble alone: it has to be the one that can be mended."""
    lines = [line.split(",", 1) for line in rows(30)]
    stamps = [lines[0][0]] + [f"01.03.2026 08:{minute:02}:00" for minute in range(30)]
    path = write([f"{stamp},{rest}" for stamp, (_, rest) in zip(stamps, lines, strict=True)])
    assert len(found(path)) == 1
    with pytest.raises(
        UserError, match=r"line 2: the stamp '01\.03\.2026 08:00:00' is not an ISO 8601 instant"
    ):
        load_campaign(path)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("-1.0", "should be greater than 0, not -1.0"),
        ("0", "should be greater than 0, not 0"),
        ("nan", "should be"),
        ("inf", "should be a finite number, not inf"),
        ('"1 K"', "should be a valid number"),
    ],
)
def test_a_spread_is_a_positive_number(write: Write, given: str, said: str) -> None:
    told = found(write(campaign=CAMPAIGN.replace('"degC"', f'"degC", spread = {given}')))
    assert any(
        line.startswith("error: campaign.toml, line 4: channels.T_env") and said in line for line in told
    ), told


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("noise = 0.5", "noise = inf", "channels.E_Y0C.noise: should be a finite number, not inf"),
        ("noise = 0.5", "noise = nan", "channels.E_Y0C.noise: should be a finite number, not nan"),
        ("noise = 0.5", 'noise = "0.5"', "channels.E_Y0C.noise: should be a valid number, not '0.5'"),
        (
            '"fit.csv"',
            '"fit.csv", set = { speed = "1" }',
            "recordings.fit.set.speed: should be a valid number",
        ),
        (
            '"fit.csv"',
            '"fit.csv", set = { speed = nan }',
            "recordings.fit.set.speed: should be a finite number",
        ),
        ('fit = { file = "fit.csv" }', "", "recordings: is empty; it needs at least 1"),
    ],
)
def test_numbers_are_finite_and_no_texts(write: Write, old: str, new: str, said: str) -> None:
    told = found(write(campaign=CAMPAIGN.replace(old, new)))
    assert any(line.startswith("error: campaign.toml") and said in line for line in told), told


def test_a_spread_belongs_to_inputs_and_errors(write: Write) -> None:
    wrong = CAMPAIGN.replace(
        '"error", unit = "um", noise = 0.5', '"temperature", unit = "degC", spread = 0.5'
    )
    told = found(write(campaign=wrong))
    wanted = (
        "error: campaign.toml, line 6: channels.E_Y0C: spread belongs to inputs of models and to errors, not"
    )
    assert any(line.startswith(wanted) and "take it away" in line for line in told), told


@pytest.mark.parametrize(
    ("mixed", "trouble"), [("08:00:00", "some stamps name a time zone"), ("25:00", "is not an ISO")]
)
def test_instants_that_do_not_fit_together(write: Write, mixed: str, trouble: str) -> None:
    lines = [
        rows()[0],
        "2026-03-01T07:59:00Z,20,0,1",
        f"2026-03-01T{mixed},20,0,",
        "2026-03-01T08:01:00Z,20,0,2",
    ]
    assert any(trouble in line for line in found(write(lines)))


@pytest.mark.parametrize("name", ["fit.csv", "fit.parquet"])
def test_rows_that_were_sent_again_are_left_out(write: Write, tmp_path: Path, name: str) -> None:
    """Once more in a block, out of order; with another value they are an error."""
    lines = rows()

    def path(lines: list[str]) -> Path:
        if name == "fit.csv":
            return write(lines)
        pd.read_csv(io.StringIO("\n".join(lines))).to_parquet(tmp_path / "made.parquet", index=False)
        return write((tmp_path / "made.parquet").read_bytes(), name=name)

    again = path([*lines[:40], *lines[21:31], *lines[40:], lines[-1]])
    said = found(again)
    assert said == [
        f"warning: {name}: 11 rows repeat an earlier row, stamp and values; they are left out; nothing is "
        "lost if a logger sent them again"
    ]
    assert load_campaign(again).recordings["fit"].time.tolist() == [60.0 * k for k in range(60)]
    wrong = path([*lines[:40], *lines[21:25], lines[25].replace(",600,", ",700,"), *lines[40:]])
    where = "line 45" if name == "fit.csv" else "row 44"
    line = "line 26" if name == "fit.csv" else "row 25"
    assert any(
        f"error: {name}, {where}: time runs backwards" in one and f"stamp of {line}, with other" in one
        for one in found(wrong)
    ), found(wrong)


def test_a_clock_that_is_put_back(write: Write) -> None:
    lines = [
        rows()[0],
        "2026-10-25T02:59:00,20,0,1",
        "2026-10-25T02:00:00,20,0,",
        "2026-10-25T02:01:00,20,0,2",
    ]
    [told] = [line for line in found(write(lines)) if line.startswith("error")]
    assert "line 3: time runs backwards by 3540 s" in told
    assert "UTC" in told


@pytest.mark.parametrize(
    ("stamps", "said"),
    [
        (
            [60e3 * k for k in range(480)],
            "a stamp every 60000 s over 333 days: perhaps these are milliseconds",
        ),
        ([1.7e12 + 1000 * k for k in range(9000)], "a stamp every 1000 s over 104 days: perhaps these are"),
        ([45000 + k / 1440 for k in range(361)], "361 rows within 0.25 s: perhaps these are days"),
        ([k / 17280 for k in range(20000)], "20000 rows within 1.16 s: perhaps these are days"),
        ([3600.0 * k for k in range(3000)], ""),  # hourly for four months
        ([86400.0 * k for k in range(120)], ""),  # a river gauge
        ([60.0 * k for k in range(4000)], ""),
        ([0.1 * k for k in range(361)], ""),
    ],
)
def test_stamps_that_are_hardly_seconds(write: Write, stamps: list[float], said: str) -> None:
    told = found(write(with_column(0, [f"{stamp:.10g}" for stamp in stamps])))
    clock = [line for line in told if "time in seconds" in line]
    assert bool(clock) == bool(said)
    assert all(line.startswith(f"warning: fit.csv, line 2: {said}") for line in clock), clock


def test_a_trouble_of_many_cells_is_told_once(write: Write) -> None:
    told = found(write(with_column(1, ["bad"] * 60)))
    assert [line for line in told if "not a number" in line] == [
        "error: fit.csv, line 2: 'T_env' is 'bad', not a number (and 59 more like it);"
        " write a number, or leave the cell empty where nothing was measured"
    ]


def test_all_mistakes_of_the_campaign_file_are_told_and_the_rest_is_checked(write: Write) -> None:
    text = CAMPAIGN.replace('"rpm"', '"rmp"').replace('"ambient temperature"', '"ambient"')
    text += 'lost = { file = "lost.csv", set = { pump = 1 } }\nbad = { fiel = "fit.csv" }\n'
    told = found(write(with_line(9, "420,20,0,x"), text))
    beginnings = [
        "error: campaign.toml, line 11: recordings.bad.fiel: unknown key; did you mean 'file'?",
        "error: campaign.toml, line 4: channels.T_env.role: 'ambient' is not known",
        "error: campaign.toml, line 5: channels.speed.unit: the unit 'rmp' is not known",
        "error: campaign.toml, line 10: recordings.lost.set.pump: no such channel",
        "error: fit.csv, line 9: 'E_Y0C' is 'x', not a number",
        "error: lost.csv: there is no such file",
    ]
    for beginning in beginnings:
        assert any(line.startswith(beginning) for line in told), (beginning, told)


def test_one_recording_under_two_names(write: Write) -> None:
    text = CAMPAIGN + 'again = { file = "fit.csv", set = { speed = 3 } }\n'
    told = [line for line in found(write(campaign=text)) if "same readings" in line]
    assert told == [
        "warning: campaign.toml, line 10: recordings.again holds the same readings as fit; "
        "name another file, or take one of them out"
    ]


def test_parquet_troubles(write: Write) -> None:
    assert "not a readable Parquet file" in found(write(b"PAR1 nothing", name="fit.parquet"))[0]


def test_exit_status_and_closing_line(write: Write) -> None:
    runner = CliRunner()
    good = runner.invoke(app, ["check", str(write())])
    assert (good.exit_code, good.stdout) == (0, "nothing is wrong with these recordings\n")
    warned = runner.invoke(app, ["check", str(write(with_line(9, "420,200,0,")))])
    assert (warned.exit_code, warned.stdout.splitlines()[-1]) == (0, "0 errors, 1 warning")
    wrong = runner.invoke(app, ["check", str(write(with_line(9, "420,x,0,")))])
    assert (wrong.exit_code, wrong.stdout.splitlines()[-1]) == (1, "1 error, 0 warnings")


@pytest.mark.parametrize("folder", ["tclab"])
def test_the_recordings_that_come_along_are_good(folder: str) -> None:
    assert check_campaign(ROOT / "datasets" / folder) == []


mutations = st.lists(
    st.tuples(
        st.integers(0, 900),
        st.sampled_from(['"', ",", ";", "\n", "\0", "-", "é", "1e999", "", "T", "\r", "nan"]),
    ),
    max_size=6,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=mutations, encoding=st.sampled_from(["utf-8", "latin-1", "utf-16", "utf-8-sig"]))
def test_a_damaged_file_is_told_or_read_never_a_crash(
    write: Write, changes: list[tuple[int, str]], encoding: str
) -> None:
    text = "\n".join(rows(30))
    for place, piece in changes:
        text = text[:place] + piece + text[place + 1 :]
    agree(write(text.encode(encoding)))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=300), name=st.sampled_from(["fit.csv", "fit.csv.gz", "fit.parquet"]))
def test_any_bytes_are_told_never_a_crash(write: Write, data: bytes, name: str) -> None:
    agree(write(data, name=name))
    agree(write(b"time,T_env,speed,E_Y0C\n" + data, name=name))
    agree(write(gzip.compress(data), name=name))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, len(CAMPAIGN)), piece=st.text(max_size=4), cut=st.integers(0, 12))
def test_a_damaged_campaign_file_is_told_never_a_crash(
    write: Write, place: int, piece: str, cut: int
) -> None:
    path = write()
    path.write_text(CAMPAIGN[:place] + piece + CAMPAIGN[place + cut :], encoding="utf-8", errors="replace")
    agree(path)


def agree(path: Path) -> None:
    """What `check` finds no error in can be loaded, and what cannot be loaded has an error in `check`."""
    try:
        errors = [finding for finding in check_campaign(path) if finding.severity == "error"]
    except UserError:
        errors = None
    try:
        load_campaign(path)
    except UserError:
        assert errors is None or errors
    else:
        # loading is lenient where values are only implausible
        assert errors is not None
        assert all(
            "can be" in error.what or "no value" in error.what or "set." in error.what for error in errors
        ), errors


@pytest.mark.parametrize(
    ("unit", "loads", "told"),
    [
        ("W", [0, -130, 0], True),
        ("W", [500, -130, 0], True),  # a brake
        ("W", [500, -3, 0], False),  # a zero that is a little off
        ("percent", [0, -80, 0], True),
        ("percent", [60, -80, 0], False),  # heats and cools in turn
    ],
)
def test_a_heat_load_below_zero(write: Write, unit: str, loads: list[int], told: bool) -> None:
    campaign = CAMPAIGN.replace(
        'role = "rotation speed", unit = "rpm"', f'role = "heat load", unit = "{unit}"'
    )
    said = found(write(with_column(2, [str(load) for load in loads * 20]), campaign))
    lines = [line for line in said if "a heat load below zero" in line]
    assert len(lines) == told
    if told:
        assert "fit.csv, line 3: 'speed' is -" in lines[0]
        assert "(and 19 more like it)" in lines[0]


def test_an_error_may_begin_at_zero(write: Write) -> None:
    """Its probe was set to zero there; a zero in the middle is a missing reading."""
    readings = [4.0 + k // 3 for k in range(58)]
    begins = [0.0, 0.0, *readings]
    assert not any(
        "exactly zero" in line for line in found(write(with_column(3, [f"{v:g}" for v in begins])))
    )
    hole = [*readings[:30], 0.0, *readings[30:], 24.0]
    assert any(
        "line 32: 'E_Y0C' is 0, exactly zero between" in line
        for line in found(write(with_column(3, [f"{v:g}" for v in hole])))
    )
