"""Structured text by a grammar of TwinCAT that others wrote; it reads about 1500 characters a second."""

from __future__ import annotations

from discovery.export.st import st_text
from tests.export.conftest import make_campaign, make_model
from tests.export.test_guarded_c import sealed


def _is_read(text: str) -> bool:
    from blark.parse import parse_source_code

    return parse_source_code(text).exception is None


def test_a_grammar_of_another_make_reads_the_text() -> None:
    text = st_text(sealed(make_model(), make_campaign()), "double")
    assert _is_read(text)
    assert not _is_read(text.replace("END_IF", "", 1))


def test_it_reads_single_precision_alike() -> None:
    """The model's own block is that of double precision with REAL for LREAL, character by character; all
    that is before it is read again.
    """
    exported = sealed(make_model(), make_campaign())
    block = "\nFUNCTION_BLOCK FB_Everything_a_model\n"
    (before, single), (_, double) = (st_text(exported, p).split(block) for p in ("float", "double"))
    assert _is_read(before)
    assert not _is_read(before.replace("END_IF", "", 1))
    assert double.replace("LREAL", "REAL") == single
    assert "LREAL" in double
