"""The tutorial and the page on Python do what they print."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.diagnosis import Diagnosis, diagnose
from discovery.experiment import load_experiment
from discovery.experiment.modelfits import fit_entry
from discovery.fitting import Fit
from discovery.models import Model
from discovery.recordings import Campaign
from tests.heaters import thinned
from tests.small import EXPERIMENT, write_small

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in (
        *(*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")),
        *(*ROOT.glob("benchmarks/*.md"), *ROOT.glob("datasets/**/README.md")),
    )
    if "CHANGELOG" not in path.name
)
CLOSE = 0.15  # figures of the tutorial: within 15 %


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the data and experiments of the repository, for output of its own."""
    for name in ("datasets", "experiments"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text("utf-8"), re.S)


def _agrees(printed: str, line: str) -> bool:
    """Same words, and figures that are close."""
    if NUMBER.sub("#", " ".join(printed.split())) != NUMBER.sub("#", " ".join(line.split())):
        return False
    pairs = zip(NUMBER.findall(printed), NUMBER.findall(line), strict=True)
    return all(abs(float(a) - float(b)) <= CLOSE * abs(float(b)) + 1e-12 for a, b in pairs)


def _once(diagnose: Callable[..., Diagnosis]) -> Callable[..., Diagnosis]:
    """The same question is answered once: `discovery run` asks what `discovery diagnose` has asked before."""
    answers: dict[str, Diagnosis] = {}

    def answered(model: Model, campaign: Campaign, *rest: Any, fitted: Fit, **more: Any) -> Diagnosis:
        read = {r: {n: v.tolist() for n, v in one.values.items()} for r, one in campaign.recordings.items()}
        asked = repr((model, campaign.channels, read, rest, fitted.model, fitted.noise))
        if asked not in answers:
            answers[asked] = diagnose(model, campaign, *rest, fitted=fitted, **more)
        return answers[asked]

    return answered


def test_the_tutorial_prints_what_it_says(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("discovery.diagnosis.diagnose", _once(diagnose))
    commands = 0
    for block in _blocks("docs/tutorial.md", "console"):
        first, *expected = block.splitlines()
        words = shlex.split(first.removeprefix("$ discovery "))
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
        commands += 1
        printed = iter(result.stdout.splitlines())
        for line in expected:
            if line != "...":
                said = any(_agrees(one, line) for one in printed)
                assert said, f"{first}: not printed: {line}\n{result.stdout}"
    assert commands == 6
    assert (place / "runs" / "heaters" / "report.html").exists()
    assert list((place / "runs" / "heaters" / "figures").glob("*.pdf"))
    _the_readme_agrees_with(json.loads((place / "runs" / "heaters" / "results.json").read_text("utf-8")))


def _the_readme_agrees_with(results: dict[str, Any]) -> None:
    """The caption of the picture: what the simple and the repaired model leave at sensor 2."""
    text = " ".join((ROOT / "README.md").read_text("utf-8").split())
    patterns = (r"sensor 2 has an rms error of (\d+) K", r"rms error on this step is below (\d+) K")
    before, rms = (re.search(pattern, text) for pattern in patterns)
    assert before
    assert rms
    at = {name: one["recordings"]["step_h1_up_090"]["T2"] for name, one in results["models"].items()}
    assert at["first_order"]["rms"] == pytest.approx(float(before[1]), rel=CLOSE)
    assert at["repaired"]["rms"] < float(rms[1])


def test_the_keys_for_library_and_held_out_recording_do_what_the_readme_says(tmp_path: Path) -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    library = re.search(r"library = \[.+?\]", text)
    assert library
    assert "from `fit = [...]` to `held_out = [...]`" in " ".join(text.split())
    write_small(tmp_path)
    content = EXPERIMENT.replace('["a", "b"]', '["a"]').replace('["c"]', '["c", "b"]')
    path = tmp_path / "experiment.toml"
    path.write_text(content + f'found = {{ kind = "sindy", bootstraps = 0, {library[0]} }}\n')
    experiment = load_experiment(path)
    found = fit_entry(experiment, "found", experiment.form.models["found"])
    assert found.model.terms
    assert set(found.fit.residuals()) == {"a"}
    assert set(found.predictions) == {"a", "b", "c"}


def test_the_lines_for_a_notebook_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On every second reading of the heaters, in less than half the time."""
    monkeypatch.chdir(thinned(tmp_path))
    names: dict[str, object] = {}
    for block in _blocks("docs/python.md", "python"):
        exec(compile(block, "docs/python.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "missing physics" in printed
    assert "('conduction_path', ['T1', 'T2'])" in printed


@pytest.mark.parametrize("page", PAGES)
def test_the_files_that_a_page_names_are_there(page: str) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", (ROOT / page).read_text("utf-8")):
        if "://" not in target:
            assert ((ROOT / page).parent / target).exists(), f"{page}: {target}"


@pytest.mark.parametrize("page", PAGES)
def test_every_option_that_a_page_names_exists(page: str) -> None:
    from typer.main import get_command

    verbs: dict[str, Any] = dict(get_command(app).commands)  # type: ignore[attr-defined]
    text = (ROOT / page).read_text("utf-8").replace("\\\n", " ")
    for verb, rest in re.findall(r"(?<![\w./-])(?:\.venv/bin/)?discovery ([a-z]+)\b([^\n`#]*)", text):
        if verb not in verbs:
            assert f"`discovery {verb}" not in text, f"{page}: there is no command '{verb}'"
            continue
        command, words = verbs[verb], rest.split()
        if hasattr(command, "commands") and words:
            assert words[0].split("|")[0] in command.commands, f"{page}: discovery {verb} {words[0]}"
            command = command.commands[words[0].split("|")[0]]
        options = [option for one in command.params for option in (*one.opts, *one.secondary_opts)]
        known = {*options, "--help", "-h"}
        named = {word.strip("),.;:").split("=")[0] for word in words if word.startswith("--")}
        assert named <= known, f"{page}: discovery {verb} has no {', '.join(named - known)}"


def test_the_style_page_quotes_twenty_pairs_and_none_of_the_old_sentences_came_back() -> None:
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", (ROOT / "docs/style.md").read_text("utf-8"), re.M)
    before = [row[0] for row in rows if row[0] not in ("before", "---")]
    assert len(before) == 20
    for page in set(PAGES) - {"docs/style.md"}:
        text = " ".join((ROOT / page).read_text("utf-8").split())
        for sentence in before:
            assert sentence not in text, f"{page}: {sentence}"


def test_every_command_that_the_readme_names_exists() -> None:
    from typer.main import get_command

    known = set(get_command(app).commands)  # type: ignore[attr-defined]
    named = set(re.findall(r"discovery ([a-z]+)[ `\n]", (ROOT / "README.md").read_text("utf-8")))
    assert named <= known
    assert {"new", "check", "run", "diagnose", "compare", "explain"} <= named
