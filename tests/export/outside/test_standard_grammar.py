"""Structured text by a grammar of IEC 61131-3 itself that others wrote."""

from __future__ import annotations

import pytest

from discovery.export.st import st_text
from tests.export.conftest import make_campaign, make_model
from tests.export.test_guarded_c import sealed


@pytest.mark.parametrize("precision", ["double", "float"])
def test_a_grammar_of_the_standard_reads_the_text(precision: str) -> None:
    import tree_sitter
    import tree_sitter_iec61131_3_st as standard

    parser = tree_sitter.Parser(tree_sitter.Language(standard.language()))
    text = st_text(sealed(make_model(), make_campaign()), precision)
    assert not parser.parse(text.encode()).root_node.has_error
    damaged = text.replace("END_IF", "", 1)
    assert parser.parse(damaged.encode()).root_node.has_error
