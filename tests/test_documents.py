"""Files, lines of Python and numbers that the documents print are those of the program."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import BaseModel

from discovery import __version__, limits, read_model, run
from discovery.diagnosis import thresholds
from discovery.evidence.outliers import FAR
from discovery.experiment.form import ExperimentForm
from discovery.models.modelfile import ModelForm
from discovery.recordings.campaignfile import CampaignForm
from discovery.runtime.opcua_form import ConnectionForm

ROOT = Path(__file__).parents[1]
PAGES = sorted(str(path.relative_to(ROOT)) for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")))
EXPERIMENT: dict[str, Any] = {
    "name": "x",
    "campaign": "campaign.toml",
    "fit": ["a"],
    "models": {"thermobalance": {"kind": "thermobalance"}},
}


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text("utf-8"), re.S)


@pytest.mark.parametrize("text", [text for page in PAGES for text in blocks(page, "toml")])
def test_a_file_that_a_page_shows_has_keys_that_exist(text: str) -> None:
    given = tomllib.loads(text)
    form: type[BaseModel] = ExperimentForm
    content = EXPERIMENT | given
    if "url" in given:
        form, content = ConnectionForm, given
    elif "states" in given:
        form, content = ModelForm, given
    elif all(isinstance(one, dict) and "role" in one for one in given.values()):
        recordings = {"a": {"file": "a.csv"}}
        form, content = CampaignForm, {"name": "x", "channels": given, "recordings": recordings}
    assert form.model_validate(content).model_fields_set == set(content)


def small(seed: int, count: int = 150) -> pd.DataFrame:
    """A mass of an hour that two loads warm."""
    rng = np.random.default_rng(seed)
    loads = np.repeat(rng.choice([0.0, 100.0, 250.0], (count // 30, 2)), 30, axis=0)
    level = np.zeros(count)
    for k in range(1, count):
        level[k] = level[k - 1] + 120 / 3600 * (0.02 * loads[k, 0] - level[k - 1])
    noisy = level + 0.05 * rng.standard_normal(count)
    columns = {"P0": loads[:, 0], "P1": loads[:, 1], "E_Y": noisy, "level": noisy + 5.0}
    return pd.DataFrame(columns, index=120.0 * np.arange(count))


def test_the_lines_on_discovery_run(capsys: pytest.CaptureFixture[str]) -> None:
    inputs, channels = ["P0", "P1"], {"E_Y": {"role": "error", "unit": "um"}}
    frame, other = small(0)[[*inputs, "E_Y"]], small(1)
    frames = {"monday": small(0)[[*inputs, "level"]]}
    names: dict[str, Any] = {
        "frame": frame,
        "other": other,
        "inputs": inputs,
        "channels": channels,
        "frames": frames,
    }
    for letter, seed in (("a", 2), ("b", 3)):
        table = small(seed)
        names[f"X_{letter}"] = np.column_stack([table.index, table[inputs]])
        names[f"Y_{letter}"] = table[["E_Y"]].to_numpy()
    for text in blocks("docs/discovery.md", "python"):
        exec(compile(text, "docs/discovery.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "lag(P0" in printed.rpartition("E_Y")[2]
    page = (ROOT / "docs" / "discovery.md").read_text("utf-8")
    swinging = page[page.index("Equations\n") : page.index("\n```\n\nThe same in files.")]
    assert swinging in printed


def test_the_files_on_a_swinging_system_run(tmp_path: Path) -> None:
    channels, experiment = (
        next(text for text in blocks("docs/discovery.md", "toml") if text.startswith(start))
        for start in ("hare =", "name     =")
    )
    source = next(text for text in blocks("docs/discovery.md", "python") if "def meadow" in text)
    names: dict[str, Any] = {}
    exec(compile(source.partition("found = ")[0], "docs/discovery.md", "exec"), names)
    recordings = ""
    for name, frame in names["meadows"].items():
        frame.rename_axis("time").to_csv(tmp_path / f"{name}.csv")
        recordings += f'[recordings.{name}]\nfile = "{name}.csv"\n'
    (tmp_path / "campaign.toml").write_text(f'name = "meadow"\n[channels]\n{channels}{recordings}')
    (tmp_path / "experiment.toml").write_text(experiment)
    results = run(tmp_path / "experiment.toml", tmp_path / "run")
    model = read_model(results.folder / "models" / "discovered.toml")
    assert sorted(abs(round(p.value, 1)) for p in model.parameters.values()) == [0.3, 0.5, 0.8, 1.0]


def numbers(values: Any) -> str:
    """As a page lists them: 0, 0.3, 1 or 3."""
    *first, last = [f"{value:g}" for value in values]
    return f"{', '.join(first)} or {last}"


def test_the_numbers_of_the_diagnosis_are_those_that_decide() -> None:
    t = thresholds
    text = " ".join((ROOT / "docs" / "mismatch.md").read_text("utf-8").split())
    for said in (
        f"`level` of {numbers(t.LEVELS)} with weights {', '.join(map(str, t.LEVELS.values()))}",
        f"{t.FLOOR:.0%} of the geometric mean of the flow".replace("%", " %"),
        f"{numbers(t.SLOW)} times the reading noise, weights {', '.join(map(str, t.SLOW.values()))}",
        f"odds of {t.ODDS} for each word",
        f"within a factor of {t.FACTOR:g} (jumps of a sensor: {FAR:g} reading noises",
        f"what it adds to an output: {t.FORM:.0%} or none".replace("%", " %"),
        f"width {t.BELIEF} of the logarithm",
        f"drawn again {t.DRAWS} times",
        f"It is at most {t.SUREST}",
        f"its probability is at least {t.NAMED}",
        f"at least {t.SHORT:g} units of log evidence",
        f"({t.CHANCE} sqrt(2 G)",
        f"{numbers(t.UNKNOWN_HEAT)} times the usual unrecorded heat",
        f"off by {numbers(100 * s for s in t.UNKNOWN_SHARES)} %",
        f"differs by {t.AIR} K from the air that is measured",
        f"than what is measured, all the time, by {t.LAYERS:.1f} K",
        f"within {t.RIVAL:g} they are not excluded",
    ):
        assert said in text, said


def test_the_limits_on_files_are_those_of_the_security_page() -> None:
    text = " ".join((ROOT / "SECURITY.md").read_text("utf-8").split())
    for said in (
        f"| TOML and JSON | {limits.MOST_TEXT >> 20} MB |",
        f"{limits.MOST_UNPACKED >> 30} GB; a line of it {limits.MOST_LINE >> 20} MB",
        " ".join(f"{n:,}" for n in (limits.MOST_ROWS,)).replace(",", " "),
        f"{limits.MOST_COLUMNS:,}, {limits.MOST_CELLS:,}".replace(",000", " 000"),
        f"(plain CSV above {limits.LARGE >> 20} MB",
        f"{limits.MOST_PIECEWISE >> 30} GB of CSV",
    ):
        assert said in text, said


def test_changelog_citation_and_program_name_one_version() -> None:
    newest = re.search(r"^## \[(\d[^\]]*)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert newest
    assert newest[1] == __version__
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {newest[1]}\ndate-released: {newest[2]}\n" in citation
