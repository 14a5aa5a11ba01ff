"""A run to report on, and its page."""

from __future__ import annotations

from pathlib import Path

import pytest

from discovery.report import write_report
from tests.report import sample


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(sample.write_sample(tmp_path_factory.mktemp("runs") / "cutting fluid"))


@pytest.fixture(scope="module")
def page(folder: Path) -> str:
    return write_report(folder).read_text("utf-8")
