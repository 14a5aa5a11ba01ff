"""The tutorial and the page on Python do what they print."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from discovery.cli import app

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
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


def test_the_tutorial_prints_what_it_says(place: Path) -> None:
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


@pytest.mark.usefixtures("place")
def test_the_lines_for_a_notebook_run(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {}
    for block in _blocks("docs/python.md", "python"):
        exec(compile(block, "docs/python.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "missing physics" in printed
    assert "('conduction_path', ['T1', 'T2'])" in printed


def test_the_files_that_the_readme_names_are_there() -> None:
    for page in ("README.md", "docs/tutorial.md", "docs/python.md"):
        text = (ROOT / page).read_text("utf-8")
        for target in re.findall(r"\]\(([^)#]+)\)", text):
            if "://" not in target:
                assert ((ROOT / page).parent / target).exists(), f"{page}: {target}"


def test_every_command_that_the_readme_names_exists() -> None:
    from typer.main import get_command

    known = set(get_command(app).commands)  # type: ignore[attr-defined]
    named = set(re.findall(r"discovery ([a-z]+)[ `\n]", (ROOT / "README.md").read_text("utf-8")))
    assert named <= known
    assert {"new", "check", "run", "diagnose", "compare", "explain"} <= named
