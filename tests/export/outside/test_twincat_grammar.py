"""Structured text by a grammar of TwinCAT that others wrote."""

from __future__ import annotations

from discovery.export.st import st_text
from tests.export.conftest import make_campaign, make_model
from tests.export.test_guarded_c import sealed


def test_a_grammar_of_another_make_reads_the_text() -> None:
    from blark.parse import parse_source_code

    for precision in ("double", "float"):
        found = parse_source_code(st_text(sealed(make_model(), make_campaign()), precision))
        assert found.exception is None
