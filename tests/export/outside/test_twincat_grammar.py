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


def test_the_grammar_refuses_what_it_does_not_know() -> None:
    program = "PROGRAM p\nVAR\n    a : LREAL;\nEND_VAR\nIF a > 0.0 THEN\n    a := 0.0;\nEND_IF\nEND_PROGRAM\n"
    assert _is_read(program)
    assert not _is_read(program.replace("END_IF", ""))


def test_single_precision_is_the_same_text() -> None:
    """With REAL for LREAL, and a smaller largest exponent of exp(a): what was read above, else character by
    character.
    """
    exported = sealed(make_model(), make_campaign())
    single, double = (st_text(exported, precision) for precision in ("float", "double"))
    for before, after in (("a > LREAL#300", "a > LREAL#69"), ("-LREAL#300", "-LREAL#69"), ("LREAL", "REAL")):
        assert before in double
        double = double.replace(before, after)
    assert single == double
