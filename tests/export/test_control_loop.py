"""The page on the control loop: its C program prints what the page says, its names exist."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from discovery.export.c import c_files
from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.replay import CFLAGS
from discovery.export.seal import open_seal
from discovery.export.settling import beginning
from discovery.export.st import st_text
from discovery.fitting import fit_model
from discovery.models import read_model
from discovery.recordings import load_campaign
from tests.export.conftest import needs_gcc

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "control_loop.md").read_text("utf-8")


def block(language: str) -> str:
    [text] = re.findall(rf"```{language}\n(.*?)```", PAGE, re.S)
    return str(text)


@pytest.fixture(scope="module")
def exported() -> Exported:
    """As `discovery run experiments/nmv5000.toml` fits it."""
    machine = load_campaign(ROOT / "datasets" / "nmv5000", only=["fit"])
    outputs = ["E_Y0C", "E_Z0T", "E_R0T", "E_A0C"]
    given = read_model(ROOT / "datasets" / "nmv5000" / "thermobalance.toml")
    fitted = fit_model(given, machine, ["fit"], outputs).model
    body, seal = open_seal(render(make_document(fitted, machine, ["fit"])), "test")
    return from_document(body, seal, "test")


@needs_gcc
@pytest.mark.parametrize("optimised", [True, False])
def test_the_c_program_of_the_page_prints_what_it_says(
    exported: Exported, optimised: bool, tmp_path: Path
) -> None:
    for name, text in c_files(exported).items():
        (tmp_path / name).write_text(text)
    (tmp_path / "main.c").write_text(block("c"))
    source = ("main.c", "thermobalance_five_bodies.c", "-lm", "-o", "loop")
    command = ["gcc", *(one for one in CFLAGS if optimised or one != "-O2"), *source]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "loop"], capture_output=True, text=True, check=True)
    number = re.compile(r"-?\d+(?:\.\d+)?")
    for printed, said in zip(done.stdout.splitlines(), block("text").splitlines(), strict=True):
        assert number.sub("#", printed) == number.sub("#", said)
        found, wanted = ([float(one) for one in number.findall(line)] for line in (printed, said))
        assert found[:2] == wanted[:2]  # time and mode
        assert found[2] == pytest.approx(wanted[2], rel=0.05, abs=0.05)


def test_the_other_blocks_use_names_that_the_files_have(exported: Exported) -> None:
    program = st_text(exported)
    used = re.findall(r"\b((?:in|ok|offset)_\w+|FB_\w+)", block("pascal"))
    assert len(used) > 8
    assert all(re.search(rf"\b{name}\b", program) for name in used)
    inputs = set(exported.compiled.inputs)
    assert set(re.findall(r'"(\w+)": [\d.]+', block("python"))) <= inputs


def test_the_figures_of_the_page_are_those_of_the_export(exported: Exported) -> None:
    [source] = [text for name, text in c_files(exported).items() if name.endswith("bodies.c")]
    settings = source[source.index("default_settings = {") :].partition("};")[0]
    rows = [[float(n) for n in re.findall(r"R\(([^)]+)\)", line)] for line in settings.splitlines()]
    *lists, hold, freeze, recover, settle = [row for row in rows if row]
    rates, ends = lists[-1][: len(exported.compiled.outputs)], [hold[0], freeze[0], recover[0], settle[0]]
    said = re.search(r"by at most `set.rate_of_offset` per second, (\S+) to (\S+) um/s", PAGE)
    assert said
    assert (float(said[1]), float(said[2])) == (round(min(rates), 2), round(max(rates), 2))
    assert ends == [4 * 3600, 2 * 3600, 300, 8 * 3600]
    start, moves = beginning(exported)
    for words in ("about 17 h, because the slowest time constant is 5.6 h", "COLD"):
        assert words in start
    assert "0.81 um (E_Z0T)" in moves
    assert "1.4 um/m (E_A0C)" in moves
    for words in (
        "about 17 h, because the slowest time constant is 5.6 h",
        "up to 0.81 um (the tilt: 1.4 um/m) in a tick of 10 s",
    ):
        assert words in " ".join(PAGE.split())
    for words in ("missing for 4 h", "(COLD) lasts 8 h", "or wait 5 min", "`set.age` (300 s)"):
        assert words in " ".join(PAGE.split())
