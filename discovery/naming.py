"""What a name in a file may be: expressions use the names of channels, parameters and states alike."""

import keyword
import re

# Functions of expressions: name -> (fewest, most) arguments.
FUNCTIONS = {
    "abs": (1, 1),
    "min": (2, 8),
    "max": (2, 8),
    "exp": (1, 1),
    "log": (1, 1),
    "sqrt": (1, 1),
    "sign": (1, 1),
    "where": (3, 3),
    "tanh": (1, 1),
    "delay": (2, 2),
    "lag": (2, 2),
    "play": (2, 2),
}


def is_word(name: str) -> bool:
    """Whether an expression can use a name: ASCII alone, since Python's parser reads some letters as others.

    >>> is_word("T_env"), is_word("T env"), is_word("µ"), is_word("if")
    (True, False, False, False)
    """
    return bool(re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII)) and not keyword.iskeyword(name)


def is_taken(name: str) -> bool:
    """Whether a word has a meaning of its own in expressions, which Python's parser reads.

    >>> is_taken("lag"), is_taken("global"), is_taken("sun")
    (True, True, False)
    """
    return name == "time" or name in FUNCTIONS or keyword.iskeyword(name)
