"""As a new user would: a CSV of one's own, columns renamed, in Fahrenheit, from nothing to a diagnosis."""

from __future__ import annotations

import csv
import gzip
import io
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app

TCLAB = Path(__file__).parents[2] / "datasets" / "tclab"
HEADER = "Elapsed (min);Heater A 1;Heater A 2;Plate 1 temp;Plate 2 temp"


def own_csv(source: str, target: Path, every: int = 1) -> None:
    """A run of the heaters as an engineer may have it: semicolons, decimal commas, minutes, Fahrenheit."""
    with io.TextIOWrapper(gzip.open(TCLAB / f"{source}.csv.gz")) as file:
        rows = list(csv.DictReader(file))[::every]
    lines = [HEADER]
    for row in rows:
        numbers = [float(row["time"]) / 60, float(row["heater1"]), float(row["heater2"])]
        numbers += [float(row[name]) * 1.8 + 32 for name in ("T1", "T2")]
        lines.append(";".join(f"{number:.4f}".replace(".", ",") for number in numbers))
    target.write_text("\n".join(lines) + "\n", "utf-8")


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("desk")
    own_csv("random_both_01", folder / "monday.csv", every=2)
    own_csv("step_h1_up_090", folder / "tuesday.csv")
    return folder


def test_from_nothing_to_a_diagnosis_in_four_commands(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(desk)
    commands = [
        "new rig --quick --from monday.csv --from tuesday.csv",  # the tutorial compares the models
        "check rig",
        "diagnose rig/experiment.toml --out answer",
        "explain conduction_path",
    ]
    said = []
    for command in commands:
        result = CliRunner().invoke(app, command.split())
        assert result.exit_code == 0, result.output
        said.append(result.output)
    assert "Plate_1_temp: temperature, degF" in said[0]
    assert "no room temperature was recorded" in said[0]
    assert "nothing is wrong" in said[1]
    assert "formula" in said[3]
    diagnosis = json.loads((desk / "answer" / "diagnosis.json").read_text())
    assert diagnosis["verdict"] == "missing physics"
    found = {(one["effect"], *one["states"]): one for one in diagnosis["physics"]}
    # The source documents heat transfer between the heaters and a sensor that lags by about 20 s.
    assert {("conduction_path", "Plate_1_temp", "Plate_2_temp"), ("sensor_lag", "Plate_1_temp")} <= set(found)
    lags = [
        p["value"] for p in found["sensor_lag", "Plate_1_temp"]["parameters"].values() if p["unit"] == "s"
    ]
    assert 10 < lags[0] < 30
    proof = diagnosis["improvement"]["held_out"]["tuesday"]
    assert proof["rms_after"] < 0.3 * proof["rms_before"]
    page = (desk / "answer" / "report.html").read_text("utf-8")
    assert "Physics is missing in “first_order”" in page


@pytest.fixture(scope="module")
def one(desk: Path) -> Path:
    """A project from one recording."""
    result = CliRunner().invoke(app, ["new", str(desk / "one"), "--from", str(desk / "tuesday.csv")])
    assert result.exit_code == 0, result.output
    return desk / "one"


def test_values_in_fahrenheit_arrive_in_celsius(one: Path) -> None:
    from discovery.recordings import load_campaign

    campaign = load_campaign(one)
    with gzip.open(TCLAB / "step_h1_up_090.csv.gz", "rt") as file:
        first = next(csv.DictReader(file))
    recording = campaign.recordings["first_part"]
    assert recording.values["Plate_1_temp"][0] == pytest.approx(float(first["T1"]), abs=1e-3)
    assert recording.time[1] - recording.time[0] == pytest.approx(2.0, abs=0.02)
    experiment = tomllib.loads((one / "experiment.toml").read_text())
    assert (experiment["fit"], experiment["held_out"]) == (["first_part"], ["last_part"])


def test_a_room_that_nobody_measured_is_an_unknown_with_a_spread(desk: Path) -> None:
    from discovery.recordings import load_campaign

    result = CliRunner().invoke(
        app, ["new", str(desk / "room"), "--quick", "--from", str(desk / "tuesday.csv")]
    )
    assert "no room temperature was recorded: T_env is an unknown of each recording" in " ".join(
        result.output.split()
    )
    assert (load_campaign(desk / "room").channels["T_env"].spread or 0.0) >= 1.0


def test_nothing_is_overwritten(one: Path, desk: Path) -> None:
    again = CliRunner().invoke(app, ["new", str(one), "--from", str(desk / "tuesday.csv")])
    assert again.exit_code == 1
    assert "campaign.toml is there already" in again.stderr


def test_a_table_of_errors_makes_files_that_load(tmp_path: Path) -> None:
    from discovery.experiment import load_experiment

    rows = ["time,T_hall [°F],Spindle rpm,P_drive (kW),Coolant temp (°C),E_Y0C [µm],E_A0C [µm/m],comp E_Y0C"]
    rows += [
        f"2026-03-01T08:{k:02d}:00,{70 + k / 30:.2f},{600 * (k % 2)},{0.3 + k / 100:.2f},"
        f"20.5,{k / 9:.2f},{k / 7:.2f},{3 + k // 30}"
        for k in range(60)
    ]
    (tmp_path / "shift.csv").write_text("\n".join(rows), "utf-8")
    result = CliRunner().invoke(
        app, ["new", str(tmp_path / "machine"), "--from", str(tmp_path / "shift.csv")]
    )
    assert result.exit_code == 0, result.output
    experiment = load_experiment(tmp_path / "machine" / "experiment.toml")
    channels = experiment.campaign.channels
    assert {name: (c.role, c.unit) for name, c in channels.items()} == {
        "T_hall": ("ambient temperature", "degC"),
        "Spindle": ("rotation speed", "rpm"),
        "P_drive": ("heat load", "W"),
        "Coolant_temp": ("coolant temperature", "degC"),
        "E_Y0C": ("error", "um"),
        "E_A0C": ("error", "um/m"),
        "comp_E_Y0C": ("applied correction", "um"),
    }
    assert experiment.campaign.recordings["first_part"].values["E_Y0C"][9] == pytest.approx(4.0)
    assert experiment.outputs == ("E_Y0C", "E_A0C")
    assert experiment.campaign.recordings["first_part"].values["P_drive"][0] == pytest.approx(300.0)
    assert experiment.model_file("first_order").outputs == {}


def test_the_first_model_counts_in_what_values_have_once_they_are_loaded(tmp_path: Path) -> None:
    from discovery.experiment import load_experiment
    from discovery.models.dimensions import check_dimensions

    rows = ["time,T_hall [°C],P_drive [hp],E_Y0C [mm],E_A0C [mm/m]"]
    on = [k // 20 % 2 for k in range(120)]
    heat = np.convolve(on, np.exp(-np.arange(120) / 15))[:120]
    rows += [f"{60 * k},{22 + k / 90:.2f},{on[k]},{heat[k] / 90:.4f},{heat[k] / 70:.4f}" for k in range(120)]
    (tmp_path / "shift.csv").write_text("\n".join(rows), "utf-8")
    CliRunner().invoke(app, ["new", str(tmp_path / "machine"), "--from", str(tmp_path / "shift.csv")])
    experiment = load_experiment(tmp_path / "machine" / "experiment.toml")
    model, channels = experiment.model_file("first_order"), experiment.campaign.channels
    assert (channels["P_drive"].unit, channels["E_A0C"].unit) == ("W", "um/m")
    assert model.parameters["gain_E_A0C_P_drive"].unit == "um/m/W/s"
    assert check_dimensions(model, channels) == []


def test_the_gain_of_a_load_without_a_unit_is_a_rate(tmp_path: Path) -> None:
    from discovery.experiment import load_experiment

    rows = ["time,heater,boiler_temp"]
    on = [k // 20 % 2 for k in range(120)]
    heat = np.convolve(on, np.exp(-np.arange(120) / 15))[:120]
    rows += [f"{k},{on[k]},{22 + heat[k]:.3f}" for k in range(120)]
    (tmp_path / "shift.csv").write_text("\n".join(rows), "utf-8")
    CliRunner().invoke(app, ["new", str(tmp_path / "boiler"), "--from", str(tmp_path / "shift.csv")])
    experiment = load_experiment(tmp_path / "boiler" / "experiment.toml")
    assert experiment.campaign.channels["heater"].unit == "1"
    model = experiment.model_file("first_order")
    assert model.parameters["gain_boiler_temp_heater"].unit == "K/s"


def test_columns_that_say_nothing_stay_out(tmp_path: Path) -> None:
    for name, column in (("one", "extra"), ("two", "other")):
        rows = [f"{k},{k % 3},{20 + k / 9},24.3,7,{k % 5}" for k in range(30)]
        (tmp_path / f"{name}.csv").write_text("\n".join([f"time,P,T1,T2,fault,{column}", *rows]), "utf-8")
    files = ["--from", str(tmp_path / "one.csv"), "--from", str(tmp_path / "two.csv")]
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), *files])
    assert result.exit_code == 0, result.output
    assert "column 'extra' is not in every file: left out" in result.output
    assert "column 'fault' never moves in the recordings to fit: left out" in result.output
    channels = tomllib.loads((tmp_path / "rig" / "campaign.toml").read_text())["channels"]
    assert set(channels) == {"P", "T1", "T2", "T_env"}
    experiment = tomllib.loads((tmp_path / "rig" / "experiment.toml").read_text())
    assert experiment["outputs"] == ["T1"]  # a sensor that never moves is not an output


@pytest.mark.parametrize(
    ("header", "term", "hint"),
    [
        ("time,current [A],temperature", "gain_temperature_current*current**2", False),
        ("time,motor current,temperature", "gain_temperature_motor_current*motor_current**2", False),
        ("time,current (mA),temperature", "gain_temperature_current*current**2", False),
        ("time,speed [rpm],temperature", "gain_temperature_speed*speed", False),
        ("time,voltage,temperature", "gain_temperature_voltage*voltage**2", False),
        ("time,heater voltage,temperature", "gain_temperature_heater_voltage*heater_voltage**2", False),
        ("time,V,temperature", "gain_temperature_V*V**2", False),
        ("time,U1 [V],temperature", "gain_temperature_U1*U1**2", False),
        ("time,valve,temperature", "gain_temperature_valve*valve", False),
        ("time,door,temperature", None, True),
    ],
)
def test_where_no_power_is_recorded(tmp_path: Path, header: str, term: str | None, hint: bool) -> None:
    from discovery.experiment import load_experiment

    rows = [f"{k},{k // 10 % 2},{20 + k / 9}" for k in range(60)]
    (tmp_path / "run.csv").write_text("\n".join([header, *rows]), "utf-8")
    result = CliRunner().invoke(
        app, ["new", str(tmp_path / "rig"), "--quick", "--from", str(tmp_path / "run.csv")]
    )
    assert result.exit_code == 0, result.output
    assert ("what heats the machine" in result.output) is hint
    load_experiment(tmp_path / "rig" / "experiment.toml")
    model = tomllib.loads((tmp_path / "rig" / "model.toml").read_text())
    assert (term in [one["expression"] for one in model["terms"]]) is (term is not None)
    check = CliRunner().invoke(
        app, ["check", str(tmp_path / "rig"), "--model", str(tmp_path / "rig/model.toml")]
    )
    assert check.exit_code == 0, check.output


def test_body_temperatures_alone_drive_the_errors(tmp_path: Path) -> None:
    """The usual table of a spindle test: some temperatures, a displacement, nothing that says why."""
    from discovery.experiment import load_experiment

    rows = [f"{k},{20 + k / 9},{20 + k / 20},21,{k / 7}" for k in range(60)]
    (tmp_path / "run.csv").write_text("\n".join(["time_min,T1,T2,T_room,dZ_um", *rows]), "utf-8")
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), "--from", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    assert "what heats the machine:" not in result.output
    experiment = load_experiment(tmp_path / "rig" / "experiment.toml")
    assert experiment.campaign.channels["T1"].role == "other input"
    assert experiment.campaign.channels["T1"].between == "linear"
    assert {"T1", "T2"} <= set(experiment.model_file("first_order").inputs)


def test_a_fan_in_percent_cools_in_its_own_unit(tmp_path: Path) -> None:
    from discovery.experiment import load_experiment
    from discovery.models.dimensions import check_dimensions

    rows = [
        f"{60 * k},{21 + k % 4 / 9},{500 * (k // 9 % 2)},{50 * (k // 7 % 3)},{20 + k / 9}" for k in range(60)
    ]
    table = "\n".join(["time,Room (C),Heater (W),Fan %,Oven (C)", *rows])
    (tmp_path / "run.csv").write_text(table, "utf-8")
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), "--from", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    experiment = load_experiment(tmp_path / "rig" / "experiment.toml")
    model = experiment.model_file("first_order")
    assert "Fan" in model.inputs
    assert check_dimensions(model, experiment.campaign.channels) == []


def test_a_coolant_with_a_flow_can_be_offered_as_convection(tmp_path: Path) -> None:
    """What the flow and its temperature are for: the model has a path to the fluid, gated by the flow."""
    from discovery.experiment import load_experiment
    from discovery.models.dimensions import check_dimensions

    rows = [f"{k},21,{18 + k % 4 / 9},{8 * (k // 9 % 2)},{k % 3},{20 + k / 9}" for k in range(60)]
    (tmp_path / "run.csv").write_text("\n".join(["time,T_room,T_coolant,flow_lpm,P_W,T_motor", *rows]))
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), "--from", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    [line] = [one for one in result.output.splitlines() if one.startswith("  T_coolant")]
    assert "fluid temperature, degC ? " in line
    assert "assumed to be the fluid of flow" in line
    experiment = load_experiment(tmp_path / "rig" / "experiment.toml")
    model = experiment.model_file("first_order")
    assert {"T_coolant", "flow"} <= set(model.inputs)
    assert check_dimensions(model, experiment.campaign.channels) == []  # in l/min, as with a pump that is on


def test_a_discharge_warms_although_its_power_is_below_zero(tmp_path: Path) -> None:
    """The gain that a plain least-squares fit of dT/dt on the power would find can be told by the model."""
    from discovery.experiment import load_experiment

    loads = [-3000 * (k // 9 % 2) for k in range(60)]
    rows = [f"{k},{load},{20 - sum(loads[:k]) / 9000}" for k, load in enumerate(loads)]
    (tmp_path / "run.csv").write_text("\n".join(["time,Power [W],T1", *rows]))
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), "--from", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    assert "'Power' is below zero in 45% of its readings" in result.output  # 18 of the first 40 rows
    gain = (
        load_experiment(tmp_path / "rig" / "experiment.toml")
        .model_file("first_order")
        .parameters["gain_T1_Power"]
    )
    assert gain.min < -1 / 9000
    check = CliRunner().invoke(app, ["check", str(tmp_path / "rig")])
    assert "'Power' is -3000 W, a heat load below zero" in check.output


def test_noise_around_zero_is_no_load_below_zero(tmp_path: Path) -> None:
    rows = [f"{k},{-1 if k % 9 == 0 else 100 * (k % 3)},{20 + k / 9}" for k in range(60)]
    (tmp_path / "run.csv").write_text("\n".join(["time,Power [W],T1", *rows]))
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), "--from", str(tmp_path / "run.csv")])
    assert "below zero" not in result.output
    assert "min = 0.0 }" in (tmp_path / "rig" / "model.toml").read_text().split("gain_T1_Power")[1][:60]
