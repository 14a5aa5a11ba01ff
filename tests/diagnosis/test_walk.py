"""The walk over a grid of noise settings: it finds the most likely nodes, and asks for few others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
import pytest

from discovery.diagnosis.walk import KEPT, SMALL, Node, walked

SIZE = (5, 6, 7, 3)
NODES = list(product(*map(range, SIZE)))


@dataclass(frozen=True)
class At:
    """What is known at a node."""

    node: Node
    evidence: float


def near(node: Node, axes: tuple[int, ...] = (0, 1, 2, 3)) -> list[Node]:
    steps = [(axis, step) for axis in axes for step in (-1, 1)]
    found = [tuple(at + step * (k == axis) for k, at in enumerate(node)) for axis, step in steps]
    return [one for one in found if all(0 <= at < size for at, size in zip(one, SIZE, strict=True))]


def hill(seed: int) -> dict[Node, float]:
    """Log evidence of each node: a hill nearly along the axes, with its top anywhere in the grid."""
    draw = np.random.default_rng(seed)
    root = draw.normal(0.0, 0.1, (4, 4)) + np.diag(draw.uniform(0.5, 1.5, 4))
    top = draw.uniform(0.0, np.array(SIZE) - 1.0)
    return {node: -float(np.sum((root @ (np.array(node) - top)) ** 2)) for node in NODES}


def walk(levels: dict[Node, float], start: Node, goal: float = -np.inf) -> tuple[list[At], list[Node]]:
    """The nodes that are kept, and those that were tried."""
    asked = []

    def tried(node: Node) -> At:
        asked.append(node)
        return At(node, levels[node])

    return walked([start], [near], tried, goal), asked


@pytest.mark.parametrize("seed", range(20))
def test_the_most_likely_node_is_found_wherever_the_walk_begins(seed: int) -> None:
    levels = hill(seed)
    best = max(levels, key=lambda node: levels[node])
    total = np.logaddexp.reduce(list(levels.values()))
    for start in [(0, 0, 0, 0), (4, 5, 6, 2), (2, 3, 3, 1)]:
        kept, asked = walk(levels, start)
        assert kept[0].node == best
        assert [one.evidence for one in kept] == sorted((one.evidence for one in kept), reverse=True)
        assert len(kept) == KEPT
        assert len(asked) == len(set(asked)) < 100  # of 630
        four = np.sort(list(levels.values()))[-KEPT:]
        found = np.logaddexp.reduce([one.evidence for one in kept])
        assert found == pytest.approx(np.logaddexp.reduce(four), abs=0.1)
        assert found <= total


def test_below_a_goal_the_top_says_enough() -> None:
    levels = hill(3)
    top = max(levels.values())
    few, all_around = (walk(levels, (0, 0, 0, 0), goal) for goal in (top + 1.0, top))
    assert few[0][0] == all_around[0][0]
    assert len(few[1]) < len(all_around[1])


def test_a_second_way_begins_where_the_first_one_ends() -> None:
    """With the first three axes alone, the last one stays where it was."""
    levels = hill(5)
    ways: list[Callable[[Node], list[Node]]] = [partial(near, axes=(0, 1, 2)), near]
    start = (0, 0, 0, 0)

    def tried(node: Node) -> At:
        return At(node, levels[node])

    first = walked([start], ways[:1], tried, -np.inf)
    assert {one.node[3] for one in first} == {0}
    both = walked([start], ways, tried, -np.inf)
    assert both == walk(levels, start)[0]
    near_it, far = first[0].evidence + 1e-9, first[0].evidence + 2 * SMALL + 1e-9
    assert walked([start], ways, tried, near_it)[0] == both[0]  # it may end below the top
    assert walked([start], ways, tried, far) == walked([start], ways[:1], tried, np.inf)
    assert walked([start], (), tried, -np.inf) == [tried(start)]


def test_of_two_hills_the_higher_one_counts() -> None:
    """The way between them is lower than both."""
    tops = {(0, 2, 3, 1): 0.0, (4, 3, 3, 1): 3.0}
    levels = {
        n: max(
            high - 2.0 * sum((a - b) ** 2 for a, b in zip(n, top, strict=True)) for top, high in tops.items()
        )
        for n in NODES
    }

    def tried(node: Node) -> At:
        return At(node, levels[node])

    starts = [(0, 0, 0, 0), (4, 0, 0, 0)]
    assert walked(starts[:1], [near], tried, -np.inf)[0].node == (0, 2, 3, 1)
    assert walked(starts, [near], tried, -np.inf)[0].node == (4, 3, 3, 1)
