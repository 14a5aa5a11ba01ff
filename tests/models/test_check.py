"""`discovery check CAMPAIGN --model FILE`."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.models.check import check_models

DATA = Path(__file__).parents[2] / "datasets" / "nmv5000"


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """The campaign of the dataset with two of its recordings: a check compares all it has with each other."""
    head, _ = (DATA / "campaign.toml").read_text("utf-8").split("[recordings]")
    files = "".join(f'{name} = {{ file = "{name}.csv.gz" }}\n' for name in ("fit", "validation"))
    (tmp_path / "campaign.toml").write_text(f"{head}[recordings]\n{files}", "utf-8")
    for name in ("fit", "validation"):
        (tmp_path / f"{name}.csv.gz").symlink_to(DATA / f"{name}.csv.gz")
    return tmp_path


def test_the_models_of_the_dataset_fit_it() -> None:
    assert list(check_models(DATA, [DATA / "thermobalance.toml", DATA / "dry_thermobalance.toml"])) == []


def test_a_unit_that_does_not_fit_is_a_warning(two: Path, tmp_path: Path) -> None:
    text = (DATA / "dry_thermobalance.toml").read_text()
    bad = tmp_path / "bad.toml"
    bad.write_text(
        text.replace('hA_table   = { start = 3.0,  unit = "W/K"', 'hA_table   = { start = 3.0,  unit = "W"')
    )
    done = CliRunner().invoke(app, ["check", str(two), "--model", str(bad)])
    assert "warning: model 'dry thermobalance, five bodies', term 'air around table'" in done.output
    assert "nothing is wrong" not in done.output


def test_a_model_is_found_next_to_the_campaign(two: Path) -> None:
    """As the page on models says: `discovery check my_machine --model mine.toml`."""
    text = (DATA / "dry_thermobalance.toml").read_text()
    (two / "mine.toml").write_text(text.replace('start = 3.0,  unit = "W/K"', 'start = 3.0,  unit = "W"'))
    done = CliRunner().invoke(app, ["check", str(two), "--model", "mine.toml"])
    assert "warning: model 'dry thermobalance, five bodies', term 'air around table'" in done.output
    missing = CliRunner().invoke(app, ["check", str(two), "--model", "other.toml"])
    assert "other.toml: there is no such file" in missing.output


def test_a_name_that_the_campaign_does_not_have(two: Path, tmp_path: Path) -> None:
    text = (DATA / "dry_thermobalance.toml").read_text()
    bad = tmp_path / "bad.toml"
    bad.write_text(text.replace("T_cool", "T_jacket"))
    with pytest.raises(UserError, match="'T_jacket' is neither"):
        list(check_models(DATA, [bad]))
    done = CliRunner().invoke(app, ["check", str(two), "--model", str(bad)])
    assert (done.exit_code, "nothing is wrong" in done.output) == (1, False)


def test_an_output_that_is_an_input(tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text((DATA / "dry_thermobalance.toml").read_text().replace("E_R0T", "P_drive"))
    with pytest.raises(UserError, match=r"outputs\.P_drive: 'P_drive' is an input of the campaign"):
        list(check_models(DATA, [bad]))
