"""The lines of the comparison: what is asked, which way is better, and what was aimed at."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from discovery.challenge.intervals import Share
from discovery.challenge.methods import TITLES, WORKBENCH
from discovery.challenge.tally import Tally


@dataclass(frozen=True)
class Line:
    """One figure of every method. `sign` +1: more is better."""

    title: str
    value: Callable[[Tally], float | None]
    sign: int
    unit: str = "%"
    target: float | None = None
    count: Callable[[Tally], Share] | None = None  # the share behind it, for its interval

    def reached(self, t: Tally) -> bool | None:
        """Whether the target is reached; None without target or figure."""
        value = self.value(t)
        return None if value is None or self.target is None else self.sign * (value - self.target) >= 0


def _of(title: str, pick: Callable[[Tally], Share], sign: int, target: float | None = None) -> Line:
    return Line(title, lambda t: pick(t).percent, sign, "%", target, pick)


LINES: Sequence[Line] = (
    Line("points a case, −2 to 1", lambda t: t.points, +1, ""),
    _of("false alarms, of cases without effect", lambda t: t.false_alarms, -1, 3.0),
    _of("… with slow noise and small heat", lambda t: t.false_alarms_coloured, -1, 3.0),
    _of("out of catalogue, wrongly named", lambda t: t.outside_named, -1, 5.0),
    _of("one effect of size ≥ 1: named", lambda t: t.large_named, +1, 80.0),
    _of("… of those, right effect and place", lambda t: t.large_right, +1, 95.0),
    _of("all effects of the catalogue: right, of those named", lambda t: t.named_right, +1),
    _of("truth in the stated set, of those named", lambda t: t.stated, +1, 97.0),
    _of("measuring chain: right fault", lambda t: t.measuring_right, +1),
    _of("two effects: found, of all of them", lambda t: t.two_found, +1),
    _of("named in addition to the truth, of those named", lambda t: t.extra, -1),
    _of("right body stated first", lambda t: t.body_first, +1),
    Line("closable gap removed, median where named", lambda t: _percent(t.explained), +1, "%", 90.0),
    Line("closable gap removed, median of all", lambda t: _percent(t.explained_all), +1, "%"),
    Line("probabilities: mean gap to what came true", lambda t: t.calibration_points, -1, "points", 5.0),
    Line("windows: intersection over union", lambda t: _percent(t.overlap), +1, "%"),
    _of("95 % intervals that hold the true size", lambda t: t.coverage, +1),
    Line("seconds a case, median", lambda t: t.seconds, -1, "s", 20.0),
    Line("seconds of the processor, median", lambda t: t.processor, -1, "s"),
)


def _percent(value: float | None) -> float | None:
    return None if value is None else 100 * value


def ahead(line: Line, tallies: Mapping[str, Tally], other: str) -> float | None:
    """By how much the workbench is better than another method; None where one has no figure."""
    ours, theirs = line.value(tallies[WORKBENCH]), line.value(tallies[other])
    return None if ours is None or theirs is None else line.sign * (ours - theirs)


def figure(value: float | None, unit: str) -> str:
    """A figure as the table prints it.

    >>> figure(87.26, "%"), figure(0.934, ""), figure(None, "s")
    ('87.3 %', '0.934', '–')
    """
    if value is None:
        return "–"
    text = f"{value:.3f}" if not unit else f"{value:.1f}"
    return f"{text} {unit}".strip().replace("-", "−")


def lead(value: float | None, unit: str) -> str:
    """A difference with its sign.

    >>> lead(-3.21, "%"), lead(0.5, "")
    ('−3.2', '+0.500')
    """
    if value is None:
        return ""
    digits = 1 if unit else 3
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")


def with_interval(line: Line, t: Tally) -> str:
    """The figure of the workbench with its counts and 95 % interval."""
    text = figure(line.value(t), line.unit)
    found = line.count(t) if line.count else None
    if found is None or not found.count:
        return text
    low, high = found.interval()
    return f"{text} ({found.hits:g} of {found.count}; {100 * low:.0f} to {100 * high:.0f})"


def rows(tallies: Mapping[str, Tally]) -> list[list[str]]:
    """The comparison as cells: question, aim, workbench, then each other method with the workbench's lead."""
    others = [name for name in tallies if name != WORKBENCH]
    out = [["", "aim", TITLES[WORKBENCH], *(TITLES[name] for name in others)]]
    for line in LINES:
        if all(line.value(t) is None for t in tallies.values()):
            continue
        aim = "" if line.target is None else f"{'≥' if line.sign > 0 else '≤'} {line.target:g} {line.unit}"
        cells = [
            figure(line.value(tallies[n]), line.unit) + _bracket(lead(ahead(line, tallies, n), line.unit))
            for n in others
        ]
        out.append([line.title, aim, with_interval(line, tallies[WORKBENCH]), *cells])
    return out


def _bracket(text: str) -> str:
    return f" ({text})" if text else ""


def behind(tallies: Mapping[str, Tally]) -> list[str]:
    """A sentence for each line on which other methods are better than the workbench."""
    out = []
    for line in LINES:
        better = [
            f"{TITLES[name]} by {figure(-gap, line.unit)}"
            for name in tallies
            if name != WORKBENCH and (gap := ahead(line, tallies, name)) is not None and gap < -1e-9
        ]
        if better:
            out.append(f"{line.title}: {', '.join(better)}")
    return out
