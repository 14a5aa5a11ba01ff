"""Figures of a challenge as SVG that stands in the page."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery.challenge.intervals import Share
from discovery.challenge.methods import TITLES
from discovery.challenge.tally import Tally
from discovery.report.figures import STYLE
from discovery.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE, ORANGE, GREEN, RED, GREY = "#0a58b0", "#b84a00", "#14683f", "#b3253b", "#8a94a1"
VERDICTS = {
    "no mismatch": GREY,
    "unexplained": ORANGE,
    "missing physics": BLUE,
    "measurement fault": GREEN,
    "failed": RED,
}
KINDS = {
    "none": "no effect",
    "one": "one effect",
    "input": "unused input",
    "two": "two effects",
    "measuring": "measuring chain",
    "outside": "out of catalogue",
}


def svg(draw: Callable[[Axes], None], width: float, height: float) -> str:
    """What `draw` draws on one pair of axes, as an <svg> element; sizes in inches."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    text = io.StringIO()
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        draw(figure.add_subplot())
        figure.savefig(text, format="svg", metadata={"Date": None})
    content = text.getvalue()
    return content[content.index("<svg") :]


def power(t: Tally) -> str:
    """Share detected, named, and named rightly against the size of the effect, with 95 % intervals."""

    def draw(ax: Axes) -> None:
        bins = [b for b in t.power if b.count]
        lines = (
            ("detected", GREY, [Share(b.detected, b.count) for b in bins]),
            ("named", BLUE, [Share(b.named, b.count) for b in bins]),
            ("right, of those named", GREEN, [Share(b.right, b.named) for b in bins]),
        )
        for k, (label, colour, shares) in enumerate(lines):
            known = [(b.size * 1.04 ** (k - 1), s) for b, s in zip(bins, shares, strict=True) if s.count]
            _points(ax, [x for x, _ in known], [s for _, s in known], colour, label)
        ax.set_xscale("log")
        ax.set_xticks([b.size for b in bins], [f"{b.size:g}\n{b.count} cases" for b in bins])
        ax.minorticks_off()
        ax.set(ylim=(0, 104), xlabel="size: rms left by a refit over noise", ylabel="%")
        ax.legend(loc="lower right")

    return svg(draw, 4.6, 3.0)


def reliability(t: Tally) -> str:
    """What came true against what was said, with 95 % intervals."""

    def draw(ax: Axes) -> None:
        ax.plot([0, 100], [0, 100], color=GREY, linewidth=0.8)
        rows = t.reliability
        _points(ax, [100 * r.said for r in rows], [r.true for r in rows], BLUE, "named effects")
        for r in rows:
            ax.annotate(
                str(r.true.count),
                (100 * r.said, r.true.percent or 0.0),
                textcoords="offset points",
                xytext=(5, -9),
                fontsize=7,
            )
        ax.set(xlim=(0, 104), ylim=(0, 104), xlabel="probability said, %", ylabel="came true, %")

    return svg(draw, 3.4, 3.0)


def _points(ax: Axes, x: list[float], shares: list[Share], colour: str, label: str) -> None:
    if not x:
        return
    y = np.array([s.percent or 0.0 for s in shares])
    ends = 100 * np.array([s.interval() for s in shares])
    bars = np.maximum([y - ends[:, 0], ends[:, 1] - y], 0.0)
    ax.errorbar(
        x,
        y,
        bars,
        color=colour,
        marker="o",
        markersize=4,
        linewidth=1,
        elinewidth=0.6,
        capsize=2,
        label=label,
    )


def verdicts(t: Tally) -> str:
    """Verdicts by kind of case."""

    def draw(ax: Axes) -> None:
        kinds = [k for k in KINDS if k in t.verdicts]
        left = np.zeros(len(kinds))
        for word, colour in VERDICTS.items():
            width = np.array([t.verdicts[k].get(word, 0) for k in kinds], dtype=float)
            if width.any():
                ax.barh(range(len(kinds)), width, left=left, color=colour, label=word, height=0.62)
            for i, w in enumerate(width):
                if w:
                    ax.text(
                        left[i] + w / 2, i, f"{w:.0f}", ha="center", va="center", color="white", fontsize=7
                    )
            left += width
        ax.set_yticks(range(len(kinds)), [KINDS[k] for k in kinds])
        ax.invert_yaxis()
        ax.grid(visible=False)
        ax.set_xlabel("cases")
        ax.legend(
            loc="upper center", bbox_to_anchor=(0.45, 1.2), ncols=4, columnspacing=1.0, handlelength=1.0
        )

    return svg(draw, 5.2, 2.7)


def confusion(t: Tally) -> str:
    """Truth against what was said, numbers of effects."""
    said = {
        word: sum(row.get(word, 0) for row in t.confusion.values())
        for word in {w for r in t.confusion.values() for w in r}
    }
    last = [w for w in ("not named", "no mismatch", "unexplained", "failed") if w in said]
    special = [w for w in ("irregular heat", "out of catalogue", "no effect") if w in t.confusion]
    rows = [*sorted(set(t.confusion) - set(special)), *special]
    columns = [*(r for r in rows if r in said), *sorted(set(said) - set(rows) - set(last)), *last]

    def draw(ax: Axes) -> None:
        grid = np.array([[t.confusion[r].get(c, 0) for c in columns] for r in rows], dtype=float)
        total = grid.sum(axis=1, keepdims=True)
        ax.imshow(grid / total, cmap="Blues", vmin=0, vmax=1.3, aspect="auto")
        for i, r in enumerate(rows):
            for j, c in enumerate(columns):
                if grid[i, j]:
                    fine = r == c or c in ("no mismatch", "unexplained", "not named")
                    dark = grid[i, j] / total[i, 0] > 0.6
                    colour = "white" if dark else "black" if fine else RED
                    ax.text(
                        j,
                        i,
                        f"{grid[i, j]:.0f}",
                        ha="center",
                        va="center",
                        fontsize=7,
                        color=colour,
                        weight="normal" if fine else "bold",
                    )
        ax.set_xticks(
            range(len(columns)), [words(c) for c in columns], rotation=50, ha="right", rotation_mode="anchor"
        )
        ax.set_yticks(range(len(rows)), [words(r) for r in rows])
        ax.grid(visible=False)
        ax.set(xlabel="said", ylabel="truth")

    return svg(draw, 1.9 + 0.3 * len(columns), 1.6 + 0.22 * len(rows))


def points(tallies: Mapping[str, Tally]) -> str:
    """Mean points of every method."""

    def draw(ax: Axes) -> None:
        names = list(tallies)
        values = [tallies[n].points for n in names]
        ax.barh(range(len(names)), values, color=[BLUE, *[GREY] * (len(names) - 1)], height=0.62)
        for i, value in enumerate(values):
            ax.text(max(value, 0.0) + 0.03, i, f"{value:.2f}".replace("-", "−"), va="center", fontsize=7)
        ax.set_yticks(range(len(names)), [TITLES[n] for n in names])
        ax.invert_yaxis()
        ax.axvline(0, color="black", linewidth=0.6)
        ax.grid(visible=False)
        ax.set(xlabel="points a case (1: all right, −2: all wrong)", xlim=(min([0.0, *values]) - 0.05, 1.25))

    return svg(draw, 5.2, 2.4)


def all_figures(tallies: Mapping[str, Tally], ours: Tally) -> list[dict[str, Any]]:
    """Every figure with its title."""
    found: list[dict[str, Any]] = [
        {"title": "What was said, by kind of case", "svg": verdicts(ours)},
        {"title": "Points of each method", "svg": points(tallies)},
    ]
    if any(b.count for b in ours.power):
        found.append({"title": "Power against size (bars: 95 %)", "svg": power(ours)})
    if ours.reliability:
        found.append(
            {"title": "Are the probabilities true? (numbers: effects named)", "svg": reliability(ours)}
        )
    found.append({"title": "Effect named against truth (red: wrong)", "svg": confusion(ours), "wide": True})
    return found
