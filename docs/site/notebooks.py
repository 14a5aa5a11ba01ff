"""Notebooks as pages; the test runs them, the site shows their text and code."""

from __future__ import annotations

import json
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "notebooks"


def pages() -> dict[str, str | bytes]:
    """notebooks/NAME.md for each notebook."""
    return {f"notebooks/{path.stem}.md": _page(path) for path in sorted(FOLDER.glob("*.ipynb"))}


def _page(path: Path) -> str:
    cells = json.loads(path.read_text("utf-8"))["cells"]
    parts = []
    for cell in cells:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
    head, *rest = parts
    where = f"*The notebook itself: `docs/notebooks/{path.name}`. Run it from the folder of the repository.*"
    return "\n\n".join([head, where, *rest]) + "\n"
