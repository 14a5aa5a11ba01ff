"""Sources that are the same for every model but for a few words: files in `templates/` with @MARKS@."""

from __future__ import annotations

import re
from pathlib import Path

_FOLDER = Path(__file__).parent / "templates"


def templated(name: str, prefix: str = "", **words: str | int) -> str:
    """The template of this name with a word for each of its marks; @PREFIX@ stands in capitals at @UP@."""
    known = {"PREFIX": prefix, "UP": prefix.upper(), **words}
    return re.sub(r"@([A-Z_]+)@", lambda found: str(known[found[1]]), (_FOLDER / name).read_text())
