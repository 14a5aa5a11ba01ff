"""Figures that are too dear for a test: their commands exist, and the pages show what these have kept."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

from benchmarks import tables
from discovery.cli import app
from discovery.recordings import load_campaign

ROOT = Path(__file__).parents[1]
MEASURED = re.compile(r"\bMeasured (\d{4}-\d\d-\d\d)(?: to \d{4}-\d\d-\d\d)? with `")


def sections() -> Iterator[tuple[str, str]]:
    """Sections of the pages of figures that hold a table of them."""
    for page in sorted(ROOT.glob("benchmarks/*.md")):
        for section in re.split(r"^(?=#+ )", page.read_text("utf-8"), flags=re.M):
            if re.search(r"^\|.*\d.*\|$", section, re.M):
                yield f"{page.name}: {section.splitlines()[0]}", section


SECTIONS = dict(sections())


@pytest.mark.parametrize("name", SECTIONS)
def test_figures_say_when_and_with_which_command_they_were_measured(name: str) -> None:
    section = SECTIONS[name]
    found = MEASURED.search(section)
    assert found, f"{name}: say 'Measured YYYY-MM-DD with `COMMAND`'"
    sentence = section[found.start() :].partition(".\n")[0]
    for command in re.findall(r"`([^`]+)`", sentence):
        exists(command)


def exists(command: str) -> None:
    """Whether a command that a page names can be run: its file or verb is there, with its options."""
    program, *words = shlex.split(command)
    options = {word.partition("=")[0] for word in words if word.startswith("--")}
    if program == "discovery":
        verb = get_command(app).commands[words[0]]  # type: ignore[attr-defined]
        known = {one for p in verb.params for one in (*p.opts, *p.secondary_opts)}
        assert options <= known, command
        assert all((ROOT / word).exists() for word in words if word.endswith(".toml")), command
    elif program == "python":
        while words[0] == "-W":
            words = words[2:]
        module = words[0] == "-m"
        path = ROOT / (words[1].replace(".", "/") + ".py" if module else words[0])
        source = path.read_text("utf-8")
        ast.parse(source)
        assert "__main__" in source, command
        assert all(f'"{option}"' in source or option == "--help" for option in options), command
    elif program == "make":
        assert re.search(rf"^{words[0]}:", (ROOT / "Makefile").read_text("utf-8"), re.M), command
    else:
        assert program == "pytest", command
        assert all((ROOT / word).exists() for word in words), command


@pytest.mark.parametrize("page", tables.PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_shows_the_figures_that_a_command_has_kept(page: Path) -> None:
    text = page.read_text("utf-8")
    assert tables.shown(text) == text, "python -m benchmarks.tables writes it again"


def test_no_kept_table_is_idle() -> None:
    shown = {name for page in tables.PAGES for name in re.findall(r"<!-- table: (\w+)", page.read_text())}
    assert shown == {path.stem for path in tables.KEPT.glob("*.json")}


def test_the_uncompensated_errors_of_the_virtual_machine_are_those_of_its_page() -> None:
    fit = load_campaign(ROOT / "datasets" / "nmv5000", only=["fit"]).recordings["fit"]
    text = (ROOT / "datasets" / "nmv5000" / "README.md").read_text("utf-8")
    rows = re.findall(r"^\| (E_\w+) \| (\S+) / \S+ \| (\S+) / \S+ \| (\S+) / \S+ \|$", text, re.M)
    assert len(rows) == 4
    for name, peak, mean, variance in rows:
        read = fit.values[name][np.isfinite(fit.values[name])]
        for said, found in ((peak, np.abs(read).max()), (mean, read.mean()), (variance, read.var())):
            assert float(said) == pytest.approx(found, rel=0.03, abs=0.55), name
