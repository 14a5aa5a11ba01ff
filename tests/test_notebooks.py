"""Every notebook of the documentation runs from a folder like that of the repository."""

from __future__ import annotations

from pathlib import Path

import nbclient
import nbformat
import pytest

from tests.heaters import thinned

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_there_are_four() -> None:
    assert [path.stem for path in NOTEBOOKS] == [
        "own_data",
        "publication_figures",
        "pysindy_users",
        "two_heaters",
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On every second reading of the heaters, in less than two thirds of the time."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    book = nbformat.reads(path.read_text("utf-8"), as_version=4)  # type: ignore[no-untyped-call]
    assert not any(cell.get("outputs") for cell in book.cells), "outputs are not committed"
    place = {"metadata": {"path": str(thinned(tmp_path))}}
    nbclient.NotebookClient(book, timeout=300, resources=place).execute()
