"""Terms: safe expressions with exact derivatives, the letters every model is written in."""

from discovery.terms.dual import Dual, evaluate
from discovery.terms.expression import Apply, Expression, Name, Number, degree, names, parse, substitute, text
from discovery.terms.term import Term

__all__ = [
    "Apply",
    "Dual",
    "Expression",
    "Name",
    "Number",
    "Term",
    "degree",
    "evaluate",
    "names",
    "parse",
    "substitute",
    "text",
]
