"""The walk over a grid of noise settings to those that are most likely: a climb, and then all around them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

Node = tuple[int, ...]  # a place on the grid
Near = Callable[[Node], list[Node]]

KEPT = 4  # noise settings of a model, the most likely ones
SMALL = 8.0  # below the best in log evidence: nothing likely lies beyond such a node


class Seen(Protocol):
    """What is known at a node."""

    @property
    def evidence(self) -> float:
        """Its log evidence: nodes are compared by it."""


S = TypeVar("S", bound=Seen)


def walked(starts: Sequence[Node], ways: Sequence[Near], tried: Callable[[Node], S], goal: float) -> list[S]:
    """The most likely nodes, best first: each that matters has been asked for its neighbours, or the best
    has been, and is below a goal.

    Args:
        starts: where climbs begin: there may be several tops.
        ways: the neighbours of a node; those of the second way are asked once the first one leads no further,
            and ends near the goal.
        tried: what is known at a node; each is tried once.
        goal: log evidence from which the others matter.
    """
    levels: dict[Node, float] = {}
    best: dict[Node, S] = {}

    def level(node: Node) -> float:
        if node not in levels:
            best[node] = tried(node)
            levels[node] = float(best[node].evidence)
            if len(best) > KEPT:  # normal equations are large
                del best[min(best, key=lambda kept: levels[kept])]
        return levels[node]

    begins = list(starts)
    level(begins[0])
    for near in ways:
        top = max([_climbed(one, near, level) for one in begins], key=level)
        # a climb of the first way alone may end below the top
        if levels[top] < goal - (2 * SMALL if near is not ways[-1] else 0.0):
            break
        asked = {top}
        while True:
            least = max(levels.values()) - SMALL
            here = max((n for n in best if n not in asked and levels[n] > least), key=level, default=None)
            if here is None:
                break
            asked.add(here)
            for node in near(here):
                level(node)
        begins = [max(best, key=level)]
    return [best[node] for node in sorted(best, key=lambda node: -levels[node])]


def _climbed(here: Node, near: Near, level: Callable[[Node], float]) -> Node:
    """A node that is no less likely than its neighbours. A step that helps is taken at once, and again as
    long as it helps; the next ones are tried from there (Hooke and Jeeves, J. ACM 8 (1961) 212).
    """
    moved = True
    while moved:
        moved = False
        for other in near(here):
            step = [b - a for a, b in zip(here, other, strict=True)]
            while (there := _after(here, step)) in near(here) and level(there) > level(here):
                here, moved = there, True
    return here


def _after(node: Node, step: Sequence[int]) -> Node:
    return tuple(at + by for at, by in zip(node, step, strict=True))
