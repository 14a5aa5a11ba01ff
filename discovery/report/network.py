"""The thermal network of a model: a drawing, with bodies as nodes and heat paths as edges, and a list of the
bodies for a narrow screen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from discovery.models import Model
from discovery.report.text import number
from discovery.terms import names

WIDTH, HEIGHT = 720, 430


@dataclass(frozen=True)
class Edge:
    """A link between two nodes and the names of the terms that make it."""

    one: str
    other: str
    terms: tuple[str, ...]
    added: bool  # by a diagnosis


def edges(model: Model) -> list[Edge]:
    """Transfer terms between states, and links to the channels that a term needs."""
    found: dict[tuple[str, str], list[tuple[str, bool]]] = {}
    for term in model.terms:
        if term.source:
            ends = [(min(term.source, term.into), max(term.source, term.into))]
        else:
            outside = names(term.expression) - set(model.parameters) - {term.into, "time"}
            ends = [(name, term.into) for name in sorted(outside)]
        for pair in ends:
            found.setdefault(pair, []).append((term.name, bool(term.effect)))
    return [
        Edge(a, b, tuple(name for name, _ in terms), any(added for _, added in terms))
        for (a, b), terms in found.items()
    ]


@dataclass(frozen=True)
class Body:
    """A body for the list: `said`: what is known of it; `paths`: (name of the other end, added by a
    diagnosis).
    """

    name: str
    said: str
    paths: tuple[tuple[str, bool], ...]


def listing(model: Model, heat: Mapping[str, float], unit: str = "W") -> list[Body]:
    """The bodies of the drawing, each with the bodies and inputs that it exchanges heat with."""
    bodies, links = _bodies(model), _links(model)
    return [
        Body(
            name,
            _said(heat.get(name), unit),
            tuple(
                (link.other if link.one == name else link.one, link.added)
                for link in links
                if name in (link.one, link.other)
            ),
        )
        for name in bodies
    ]


def _bodies(model: Model) -> list[str]:
    return [name for name, state in model.states.items() if state.capacity or state.unit == "degC"]


def _links(model: Model) -> list[Edge]:
    """Without lags and other memory: they are no bodies, and their inputs are drawn at the body."""
    helpers = set(model.states) - set(_bodies(model))
    return [link for link in edges(model) if not helpers & {link.one, link.other}]


def _said(heat: float | None, unit: str) -> str:
    return "" if heat is None else f"{number(heat)} {unit}" if unit else f"{100 * heat:.0f} %"


def drawing(model: Model, heat: Mapping[str, float], unit: str = "W") -> str:
    """SVG of the network; `heat` by state colours its bodies (a share of 1 or watts, as `unit` says)."""
    bodies, links = _bodies(model), _links(model)
    inputs = sorted({end for link in links for end in (link.one, link.other)} - set(bodies))
    place = _layout(bodies, inputs, links)
    largest = max((abs(value) for value in heat.values()), default=0.0) or 1.0
    parts = [_link(link, place, set(bodies)) for link in links]
    parts += [_input(name, *place[name]) for name in inputs]
    parts += [_body(name, *place[name], heat.get(name), largest, unit) for name in bodies]
    said = "; ".join(f"{name} {number(value)} {unit}".rstrip() for name, value in heat.items())
    label = f"Thermal network of {model.name}. {f'Unmodelled heat: {said}' if said else ''}"
    return (
        f'<svg class="network" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label)}">'
        + "".join(parts)
        + "</svg>"
    )


def _layout(bodies: list[str], inputs: list[str], links: list[Edge]) -> dict[str, tuple[float, float]]:
    """Place the bodies on an inner ellipse, linked ones next to each other, and the inputs around them."""
    order = _chain(bodies, links)
    centre = (WIDTH / 2, HEIGHT / 2)
    place: dict[str, tuple[float, float]] = {}
    angles: dict[str, float] = {}
    for index, name in enumerate(order):
        angle = 2 * math.pi * index / max(len(order), 1) - math.pi / 2
        angles[name] = angle
        spread = 0.0 if len(order) == 1 else 1.0
        place[name] = (centre[0] + spread * 190 * math.cos(angle), centre[1] + spread * 115 * math.sin(angle))
    wished = {
        name: _mean_angle(
            [
                angles[e]
                for link in links
                if name in (link.one, link.other)
                for e in (link.one, link.other)
                if e in angles
            ]
        )
        for name in inputs
    }
    for index, name in enumerate(sorted(inputs, key=lambda name: wished[name])):
        angle = 2 * math.pi * (index + 0.5) / len(inputs) - math.pi
        place[name] = (centre[0] + 315 * math.cos(angle), centre[1] + 192 * math.sin(angle))
    return place


def _chain(bodies: list[str], links: list[Edge]) -> list[str]:
    left = list(bodies)
    order: list[str] = []
    near = {
        name: {e for link in links for e in (link.one, link.other) if name in (link.one, link.other)}
        for name in bodies
    }
    while left:
        following = next((name for name in left if order and name in near[order[-1]]), left[0])
        order.append(following)
        left.remove(following)
    return order


def _mean_angle(angles: list[float]) -> float:
    if not angles:
        return 0.0
    return math.atan2(sum(map(math.sin, angles)), sum(map(math.cos, angles)))


def _link(link: Edge, place: Mapping[str, tuple[float, float]], bodies: set[str]) -> str:
    (x1, y1), (x2, y2) = place[link.one], place[link.other]
    between = link.one in bodies and link.other in bodies
    look = "edge" + (" added" if link.added else "") + ("" if between else " outer")
    title = f"<title>{escape(', '.join(link.terms))}</title>"
    return f'<line class="{look}" x1="{x1:.0f}" y1="{y1:.0f}" x2="{x2:.0f}" y2="{y2:.0f}">{title}</line>'


def _body(name: str, x: float, y: float, heat: float | None, largest: float, unit: str) -> str:
    share = 0.0 if heat is None else min(1.0, abs(heat) / largest)
    said = _said(heat, unit)
    width = max(92, 9 * len(name) + 22)
    box = f'x="{x - width / 2:.0f}" y="{y - 25:.0f}" width="{width}"'
    return (
        f'<g class="body"><rect {box} height="50" rx="9"/>'
        f'<rect class="heat" style="opacity:{0.75 * share:.2f}" {box} height="50" rx="9"/>'
        f'<text x="{x:.0f}" y="{y - 2 if said else y + 5:.0f}">{escape(name)}</text>'
        + (f'<text class="watts" x="{x:.0f}" y="{y + 16:.0f}">{escape(said)}</text>' if said else "")
        + "</g>"
    )


def _input(name: str, x: float, y: float) -> str:
    width = 8 * len(name) + 18
    box = f'x="{x - width / 2:.0f}" y="{y - 13:.0f}" width="{width}"'
    return (
        f'<g class="input"><rect {box} height="26" rx="13"/>'
        f'<text x="{x:.0f}" y="{y + 4:.0f}">{escape(name)}</text></g>'
    )
