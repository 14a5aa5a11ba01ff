"""Terms: safe expressions with exact derivatives, the letters every model is written in."""

from discovery.terms.delays import delays_at
from discovery.terms.dual import Dual, Program, compiled, evaluate, program_of
from discovery.terms.expression import (
    Apply,
    Expression,
    Name,
    Number,
    degree,
    mixed,
    names,
    rewrite,
    substitute,
)
from discovery.terms.parsing import parse
from discovery.terms.printing import text
from discovery.terms.term import Term

__all__ = [
    "Apply",
    "Dual",
    "Expression",
    "Name",
    "Number",
    "Program",
    "Term",
    "compiled",
    "degree",
    "delays_at",
    "evaluate",
    "mixed",
    "names",
    "parse",
    "program_of",
    "rewrite",
    "substitute",
    "text",
]
