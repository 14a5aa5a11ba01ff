"""Structured text by a grammar of TwinCAT that others wrote."""

from __future__ import annotations

import pytest

from discovery.export.st import st_text
from tests.export.conftest import make_campaign, make_model
from tests.export.test_guarded_c import sealed


@pytest.mark.parametrize("precision", ["double", "float"])
def test_a_grammar_of_another_make_reads_the_text(precision: str) -> None:
    from blark.parse import parse_source_code

    text = st_text(sealed(make_model(), make_campaign()), precision)
    assert parse_source_code(text).exception is None
    start = text.index("END_IF")
    assert parse_source_code(text[:start] + text[start + len("END_IF") :]).exception is not None
