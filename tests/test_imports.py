"""The order of the packages: an import goes only to the left, so that each can be read without the next."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import discovery

ROOT = Path(discovery.__file__).parent
ORDER = (
    "__version__ errors forked naming printed progress",
    "threads",
    "schema extras limits",
    "files targets",
    "runfolder terms",
    "recordings",
    "models",
    "dynamics",
    "fitting effects virtual",
    "evidence evaluation frames sparse",
    "diagnosis",
    "design report export",
    "experiment runtime",
    "paper",
    "challenge firsthour estimator latex notebook",
    "commands",
    "cli",
)
LAYER = {name: k for k, names in enumerate(ORDER) for name in names.split()}
LAST = {
    ("diagnosis/diagnose.py", "design"),  # a diagnosis ends with a question about what it found
    ("experiment/pipeline.py", "paper"),  # a run of the paper's experiment ends with its page
}


def imported(file: Path) -> Iterator[str]:
    """Parts of `discovery` that a file imports when it runs, at its top or in a function."""
    tree = ast.parse(file.read_text("utf-8"))
    typing_only = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) in typing_only:
            continue
        if isinstance(node, ast.Import):
            yield from (a.name.split(".")[1] for a in node.names if a.name.startswith("discovery."))
        elif isinstance(node, ast.ImportFrom) and node.module == "discovery":
            yield from (a.name for a in node.names)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("discovery."):
            yield str(node.module).split(".")[1]


def test_every_package_has_its_place() -> None:
    there = {p.stem for p in ROOT.iterdir() if p.suffix == ".py" or any(p.glob("*.py"))}
    assert there - {"__init__"} == set(LAYER) - {"__version__"}


def test_imports_go_to_the_left() -> None:
    wrong: list[str] = []
    for file in sorted(ROOT.rglob("*.py")):
        where = file.relative_to(ROOT)
        own = where.parts[0].removesuffix(".py")
        if own == "__init__":
            continue  # names of the package, each loaded where it is asked for
        wrong += [
            f"{where} imports {name}"
            for name in set(imported(file)) - {own}
            if LAYER.get(name, 99) >= LAYER[own] and (where.as_posix(), name) not in LAST
        ]
    assert wrong == []


@pytest.mark.parametrize(
    "module", ["design.question", "design.next_experiment", "diagnosis", "diagnosis.document", "effects.own"]
)
def test_each_can_be_imported_first(module: str) -> None:
    """Two packages that need each other can be imported in one order alone."""
    done = subprocess.run(
        [sys.executable, "-c", f"import discovery.{module}"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
