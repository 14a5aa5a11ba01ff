"""Structured text by the compilers that are installed: iec2c of matiec, strucpp of STruC++."""

from __future__ import annotations

import shutil

import pytest

from discovery.export.st import st_text
from discovery.export.st.proof import COMPILERS, compiled
from tests.export.conftest import make_campaign, make_model
from tests.export.test_guarded_c import sealed


@pytest.mark.parametrize("compiler", [name for name in COMPILERS if shutil.which(name)])
@pytest.mark.parametrize("precision", ["double", "float"])
def test_a_compiler_takes_the_text(compiler: str, precision: str) -> None:
    exported = sealed(make_model(), make_campaign())
    assert compiler in compiled(st_text(exported, precision))
