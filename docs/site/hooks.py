"""Pages of the site that are made from the code at build time (`make site`); none of them is committed."""

from __future__ import annotations

import re
import sys
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath
from typing import Any

ROOT = Path(__file__).parents[2]

# Files of the repository outside docs/ that are pages, too
REPOSITORY = {
    "README.md": "index.md",
    "CHANGELOG.md": "project/changelog.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "LICENSE": "project/licence.md",
    "SECURITY.md": "project/security.md",
    "benchmarks/RESULTS.md": "project/results.md",
    "benchmarks/challenge.md": "project/challenge.md",
    "benchmarks/damages.md": "project/damages.md",
    "benchmarks/diagnosis.md": "project/diagnosis_figures.md",
    "benchmarks/fuzzing.md": "project/fuzzing.md",
    "benchmarks/paper.md": "project/paper_figures.md",
    "benchmarks/runtime.md": "project/runtime_figures.md",
    "datasets/README.md": "datasets/index.md",
    "datasets/nmv5000/README.md": "datasets/nmv5000.md",
    "datasets/tanks/README.md": "datasets/tanks.md",
    "datasets/tclab/README.md": "datasets/tclab.md",
}
NO_PAGE = "]\0"  # behind the words of a link to a file that is no page
LINK = re.compile(r"(\]\()([^)#\s]+)((?:#[^)]*)?\))")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are made from the code, and those of the repository outside docs/."""
    from mkdocs.structure.files import File

    sys.path[:0] = [
        str(ROOT),
        str(Path(__file__).parent),
    ]  # here, since mkdocs puts the path back after loading
    import commands
    import forms
    import gallery
    import notebooks
    import python_api

    made: dict[str, str | bytes] = {}
    for source, page in REPOSITORY.items():
        made[page] = _linked((ROOT / source).read_text("utf-8"), source, page)
    for maker in (commands, forms, gallery, notebooks, python_api):
        made |= maker.pages()
    for page, content in made.items():
        files.append(File.generated(config, page, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links out of docs/ into the repository become links to its pages."""
    source = page.file.src_uri
    if page.file.generated_by:
        return markdown
    return _linked(markdown, f"docs/{source}", source)


def on_post_page(output: str, **_: Any) -> str:
    """Nothing is loaded from elsewhere. Without this script search works over http; pages open from files."""
    return re.sub(r'<script src="https://unpkg\.com/[^"]*"></script>', "", output)


def _linked(text: str, source: str, page: str) -> str:
    """Links as they stand in the file `source` of the repository, turned into links of the page `page`."""

    def turned(match: re.Match[str]) -> str:
        target = match[2]
        if "://" in target or target.startswith("mailto:"):
            return match[0]
        inside = normpath(str(PurePosixPath(source).parent / target))
        if inside in REPOSITORY:
            there = REPOSITORY[inside]
        elif inside.startswith("docs/") and (ROOT / inside).is_file() and not inside.endswith(".ipynb"):
            there = inside.removeprefix("docs/")
        else:  # a file of the repository that is no page: its name alone
            return NO_PAGE
        return f"{match[1]}{relpath(there, str(PurePosixPath(page).parent))}{match[3]}"

    return _without_link(LINK.sub(turned, text))


def _without_link(text: str) -> str:
    """[words] of a link to a file that is no page become plain words."""
    return re.sub(r"\[([^\[\]]*)\]\0", r"\1", text)
