"""Laws of one variable or two, for systems of any kind: springs, dampers, outlets, overflows, amplifiers."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from discovery.terms import Apply, Expression, Name, Number
from discovery.terms.expression import rewrite

LAWS = {
    "linear": "{0}",
    "square": "{0}**2",
    "cubic": "{0}**3",
    "sqrt": "sqrt(max({0}, 0))",
    "abs": "abs({0})",
    "drag": "{0}*abs({0})",
    "sign": "tanh({0}/{1:.3g})",  # dry friction: over the width that readings cannot show
}
BELOW = 0.05  # share of its range by which noise may take a variable below zero that is never negative
QUANTILES = (0.5, 0.7, 0.85, 0.97)  # of a variable, where a threshold may stand


def laws(
    words: Sequence[str],
    variable: str,
    seen: NDArray[np.float64] | None = None,
    hidden: bool = False,
    width: float = 1.0,
) -> list[str]:
    """Expressions of a variable by the words of a library.

    Args:
        seen: (N,) values of the variable, where they are known: thresholds stand at their quantiles, and a
            root is offered to what is nowhere negative but for noise; sign, abs and drag to what is on both
            sides of zero.
        width: of the step of a sign, over which it is a tanh: a system with dry friction comes to rest.
        hidden: nothing says where the variable counts from: a root begins at its least value.

    >>> laws(["linear", "cubic"], "y")
    ['y', 'y**3']
    >>> laws(["sqrt"], "h", np.array([-1.5, 3.0]), hidden=True)
    ['sqrt(max(h - -1.5, 0))']
    >>> laws(["sqrt"], "h", np.array([-0.1, 3.0]))
    ['sqrt(max(h, 0))']
    """
    least = 0.0 if seen is None else float(np.min(seen))
    wide = 0.0 if seen is None else BELOW * float(np.ptp(seen))
    negative = seen is not None and least < -wide
    one_sided = seen is not None and (not negative or float(np.max(seen)) < wide)
    idle = {"sqrt"} if negative else set()
    idle |= {"abs", "drag", "sign"} if one_sided else set()  # as y, its square and 1
    found = [LAWS[w].format(variable, width) for w in words if w in LAWS and w not in idle]
    found += [LAWS["sqrt"].format(f"{variable} - {least:.3g}")] * ("sqrt" in words and negative and hidden)
    if "threshold" in words and seen is not None:
        levels = dict.fromkeys(float(f"{q:.3g}") for q in np.quantile(seen, QUANTILES))
        found += [f"max({variable} - {level:g}, 0)" for level in levels if np.min(seen) < level]
    return found


def products(words: Sequence[str], variables: Sequence[str]) -> list[str]:
    """Products of two variables, if the library has them.

    >>> products(["product"], ["y", "u"])
    ['y*u']
    """
    return [f"{a}*{b}" for a, b in combinations(variables, 2)] if "product" in words else []


def with_levels(expression: Expression, name: str) -> tuple[Expression, float] | None:
    """The expression with the level at which its max(..., 0) begins as a parameter, and that level; None:
    it has none.

    >>> from discovery.terms import parse, text
    >>> found = with_levels(parse("k*sqrt(max(h, 0))"), "c")
    >>> text(found[0]), found[1]
    ('k*sqrt(max(h - c, 0))', 0.0)
    """
    levels: list[float] = []

    def rule(apply: Apply) -> Expression | None:
        match apply:
            case Apply("max", (Apply("-", (variable, Number(level))), Number(0.0))):
                levels.append(level)
            case Apply("max", (variable, Number(0.0))):
                levels.append(0.0)
            case _:
                return None
        return Apply("max", (Apply("-", (variable, Name(name))), Number(0.0)))

    found = rewrite(expression, rule)
    return (found, levels[0]) if len(levels) == 1 else None
