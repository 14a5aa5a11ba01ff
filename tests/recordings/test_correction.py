"""Readings on a compensated machine: with what was applied they are the error that a model is to predict."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from discovery import campaign_from_frames
from discovery.errors import UserError
from discovery.fitting import fit_model
from discovery.fitting.starts import warm_start
from discovery.models.reduced import reduced
from discovery.recordings import Campaign, load_campaign
from discovery.recordings.check import check_campaign
from discovery.recordings.correction import uncompensated
from discovery.virtual.log import csv_gz
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import Order, take
from tests.recordings.conftest import CAMPAIGN, Write, rows

ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
INPUTS = ("T_env", "P_drive", "T_fluid")
ONE = CAMPAIGN.replace("[rec", 'corr = { role = "applied correction", unit = "um" }\n\n[rec')


def with_correction(cells: list[str], name: str = "corr") -> list[str]:
    return [f"{line},{cell}" for line, cell in zip(rows(), [name, *cells], strict=True)]


CONSTANT = with_correction(["2"] * 60)


@pytest.fixture(scope="module")
def twice(tmp_path_factory: pytest.TempPathFactory) -> tuple[Campaign, Campaign]:
    """A day of the virtual machine, uncompensated, and as its files were with 1 um steps of correction."""
    folder = tmp_path_factory.mktemp("compensated")
    columns = dict(take(Order("day", "fit", 31, hours=30.0)).columns)
    lines = ["name = 'two days'", "[channels]"]
    channels = {c.name: c for c in five_axis().channels}
    lines += [f"{name} = {{ role = '{c.role}', unit = '{c.unit}' }}" for name, c in channels.items()]
    written = {name: np.round(values, 2 if name in ERRORS else 6) for name, values in columns.items()}
    (folder / "day.csv.gz").write_bytes(csv_gz(written, dict.fromkeys(written, 6)))
    recordings = ["[recordings]", "day = { file = 'day.csv.gz' }"]
    (folder / "campaign.toml").write_text("\n".join([*lines, *recordings]) + "\n")
    for k, error in enumerate(ERRORS):
        # any model will do: what is left is an error still, only smaller
        applied = np.round(0.3 * (k + 1) * (columns["T_fluid"] - 22.0) + 0.01 * columns["P_drive"])
        known = np.isfinite(applied)
        held = applied[np.maximum.accumulate(np.where(known, np.arange(len(applied)), 0))]
        written[error] = written[error] - held
        written[f"{error}_applied"] = applied / 1000.0 if k == 0 else applied
        unit = "mm" if k == 0 else channels[error].unit
        lines.append(f"{error}_applied = {{ role = 'applied correction', unit = '{unit}' }}")
    (folder / "compensated.csv.gz").write_bytes(csv_gz(written, dict.fromkeys(written, 6)))
    recordings[1] = "day = { file = 'compensated.csv.gz' }"
    (folder / "compensated.toml").write_text("\n".join([*lines, *recordings]) + "\n")
    assert check_campaign(folder / "compensated.toml") == check_campaign(folder / "campaign.toml")
    return load_campaign(folder), load_campaign(folder / "compensated.toml")


def test_a_compensated_machine_shows_the_same_errors(twice: tuple[Campaign, Campaign]) -> None:
    plain, compensated = (campaign.recordings["day"] for campaign in twice)
    for error in ERRORS:
        np.testing.assert_allclose(compensated.values[error], plain.values[error], atol=1e-9)


def test_and_the_same_model(twice: tuple[Campaign, Campaign]) -> None:
    fits = []
    for campaign in twice:
        start = reduced(INPUTS, ERRORS, campaign.channels)
        fits.append(fit_model(warm_start(start, campaign, ["day"], ERRORS), campaign, ["day"], ERRORS).model)
    for name, parameter in fits[0].parameters.items():
        assert fits[1].parameters[name].value == pytest.approx(parameter.value, rel=1e-5, abs=1e-9)


def test_it_is_held_between_its_values_and_readings_before_it_are_left_out(write: Write) -> None:
    data = with_correction(["", "", "1", *[""] * 27, "5", *[""] * 29])
    raw = load_campaign(write()).recordings["fit"].values["E_Y0C"]
    loaded = load_campaign(write(data, ONE)).recordings["fit"].values["E_Y0C"]
    assert np.isnan(loaded[0])
    np.testing.assert_allclose(loaded[2:] - raw[2:], np.repeat([1.0, 5.0], [28, 30]) + 0 * raw[2:])
    straight = ONE.replace('unit = "um" }', 'unit = "um", between = "linear" }')
    loaded = load_campaign(write(data, straight)).recordings["fit"].values["E_Y0C"]
    assert loaded[16] - raw[16] == pytest.approx(3.0)


def test_offsets_as_the_runtime_gives_them_out(write: Write) -> None:
    text = ONE.replace('unit = "um" }', 'unit = "nm", sign = -1, corrects = "E_Y0C" }')
    raw = load_campaign(write()).recordings["fit"].values["E_Y0C"]
    loaded = load_campaign(write(CONSTANT, text)).recordings["fit"].values["E_Y0C"]
    np.testing.assert_allclose(loaded, raw - 0.002)


def test_a_recording_without_compensation(write: Write) -> None:
    text = ONE.replace('"fit.csv" }', '"fit.csv", set = { corr = 0 } }')
    raw = load_campaign(write()).recordings["fit"].values["E_Y0C"]
    np.testing.assert_array_equal(load_campaign(write(campaign=text)).recordings["fit"].values["E_Y0C"], raw)


def test_frames(write: Write) -> None:
    raw = load_campaign(write()).recordings["fit"]
    frame = pd.DataFrame({"E": raw.values["E_Y0C"], "applied": 2.0}, index=raw.time)
    channels = {"E": {"role": "error", "unit": "um"}, "applied": {"role": "applied correction", "unit": "um"}}
    campaign = campaign_from_frames({"monday": frame}, channels)
    np.testing.assert_allclose(campaign.recordings["monday"].values["E"], raw.values["E_Y0C"] + 2.0)
    with pytest.raises(UserError, match=r"channel 'applied': 'F' is not a channel of role error"):
        campaign_from_frames(
            {"monday": frame}, channels | {"applied": channels["applied"] | {"corrects": "F"}}
        )


AGAIN = 'E_Y0C_b = { role = "applied correction", unit = "um", column = "corr" }'
SECOND = 'E_Z0T = { role = "error", unit = "um/m", column = "E_Y0C" }\n\n[rec'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ONE.replace('um" }', 'um", corrects = "E_Y0" }'), "corr.corrects: 'E_Y0' is not a channel of role"),
        (ONE.replace("[rec", SECOND), "corr: the error that it corrects is not given; write corrects ="),
        (
            ONE.replace("[rec", SECOND).replace('um" }', 'um", corrects = "E_Z0T" }'),
            "a correction in um cannot belong to 'E_Z0T' in um/m; mend its unit",
        ),
        (ONE.replace('"error"', '"temperature"').replace('"um", noise', '"degC", noise'), "there is none"),
        (
            ONE.replace('"um" }', '"um", corrects = "E_Y0C" }').replace("[rec", f"{AGAIN}\n[rec"),
            "E_Y0C_b: 'E_Y0C' has two corrections; add them up",
        ),
        (ONE.replace('unit = "rpm"', 'unit = "rpm", corrects = "E_Y0C"'), "corrects belong to the role"),
    ],
)
def test_a_correction_that_belongs_to_nothing(write: Write, text: str, said: str) -> None:
    path = write(CONSTANT, text)
    assert any(said in str(one) for one in check_campaign(path)), check_campaign(path)
    with pytest.raises(UserError) as caught:
        load_campaign(path)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (
            ["", "", "", *["2"] * 57],
            "line 2: 'E_Y0C' is read before its correction 'corr' is known (and 1 more",
        ),
        (
            ["2"] * 10 + [""] * 40 + ["2"] * 10,
            "line 12: 'E_Y0C' has readings long after the last value of its correction 'corr'",
        ),
        (["0.002"] * 60, "line 2: the applied correction 'corr' is never more than 0.002; no controller"),
        (["9000"] * 60, "line 2: 'corr' is 9000 um, unusual for a channel of role applied correction"),
        ([""] * 60, "fit.csv: the applied correction 'corr' has no value at all; record it, or say set"),
    ],
)
def test_what_the_check_says_of_its_values(write: Write, cells: list[str], said: str) -> None:
    found = [str(one) for one in check_campaign(write(with_correction(cells), ONE))]
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize(
    ("data", "text", "said"),
    [
        (
            CONSTANT,
            ONE.replace('correction", unit = "um"', 'correction", unit = "umm"'),
            "the unit 'umm' is not",
        ),
        (rows(), ONE, "fit.csv, line 1: no column 'corr'"),
        ([line.replace("E_Y0C", "E_Y") for line in CONSTANT], ONE, "fit.csv, line 1: no column 'E_Y0C'"),
    ],
)
def test_of_half_a_pair_only_what_is_missing_is_told(
    write: Write, data: list[str], text: str, said: str
) -> None:
    found = [str(one) for one in check_campaign(write(data, text)) if one.severity == "error"]
    assert len(found) == 1
    assert said in found[0]


def test_half_a_pair_stays_as_it_is() -> None:
    """A recording that lacks the error, or what was applied, as one of other channels does."""
    time, series = np.arange(3.0), np.array([1.0, 2.0, 3.0])
    for name in ("corr", "E_Y0C"):
        assert uncompensated("r", time, {name: series}, {}, {"corr": "E_Y0C"}) == {name: series}


def test_known_nowhere_it_cannot_be_added(write: Write) -> None:
    with pytest.raises(UserError, match=r"fit\.csv: the applied correction 'corr' has no value; record it"):
        load_campaign(write(with_correction([""] * 60), ONE))


def test_a_channel_by_another_name(write: Write) -> None:
    text = ONE.replace("corr =", "comp_e_y0c =").replace('um" }', 'um", column = "corr" }')
    path: Path = write(CONSTANT, text.replace("[rec", SECOND))
    assert load_campaign(path).recordings["fit"].values["E_Y0C"][2] == pytest.approx(2.6)
