"""paper.html: the paper figure by figure and table by table, simulated next to measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from discovery.evaluation.paper import SOURCE
from discovery.evaluation.rolematrix import left_out, matrix, not_seen, steadiness
from discovery.evaluation.tables import Table
from discovery.experiment.experiment import Experiment
from discovery.experiment.fitted import Fitted
from discovery.experiment.results import command_of
from discovery.files import write_atomic
from discovery.paper.active_figures import section_3, section_4
from discovery.paper.chapter import Chapter, Material, attempted
from discovery.paper.film import equation_6, nozzle
from discovery.paper.influences import budgets, equation_8
from discovery.paper.left_nozzle import left_nozzle
from discovery.paper.machine import figure_2, figure_3, symmetric
from discovery.paper.recalibration import recalibration
from discovery.progress import Progress, silent
from discovery.recordings import Channel
from discovery.report.page import fill
from discovery.report.printed import printed

PAGE = "paper.html"
_IN_ORDER: tuple[tuple[str, Callable[[Material], Chapter | None]], ...] = (
    ("figure 2", figure_2),
    ("figure 3", figure_3),
    ("equations (1) to (6)", equation_6),
    ("nozzle height and flow", nozzle),
    ("figures 6 and 7", section_3),
    ("left nozzle", left_nozzle),
    ("symmetry", symmetric),
    ("equation (8)", equation_8),
    ("figures 8 and 9", section_4),
    ("budgets", budgets),
    ("test piece", recalibration),
)
NOT_REPEATED = (
    "Figures 1, 4, 5 and 8 (nozzle positions) are drawings and photographs. Figure 2 shows temperatures "
    "here, no images.",
    "Every recording comes from a simulated machine. The figures of the paper are given next to ours to "
    "compare their size; "
    "no parameter was set to meet them.",
)


def chapters(
    experiment: Experiment,
    fitted: Mapping[str, Fitted],
    results: Mapping[str, Any],
    progress: Progress = silent,
) -> list[Chapter]:
    """The chapters of the page, in the order of the paper.

    Args:
        results: content of results.json, as far as it is known before the roles are left out.
    """
    assert experiment.form.paper is not None
    material = Material(experiment, fitted, results, experiment.form.paper)
    made = []
    for name, make in _IN_ORDER:
        progress(f"the paper: {name}")
        chapter = attempted(name, partial(make, material))
        if chapter is not None:
            made.append(chapter)
    return made


def role_chapter(roles: Mapping[str, Any], channels: Mapping[str, Channel]) -> Chapter:
    """Cross-validation over roles: what the paper's validation cycle and nozzle tests ask, for every role.

    Args:
        roles: "role_matrix" of results.json.
    """
    errors = list(dict.fromkeys(e for model in roles["models"].values() for e in model["rms"]))
    units = {error: channels[error].unit for error in errors}
    lost = [f"{name} {line}" for name, model in roles["models"].items() for line in model["lost"]]
    return Chapter(
        "roles",
        "Validation: each role left out in turn",
        "Validated with a second test cycle, a nozzle at 100 mm and a nozzle on the left; parameters "
        "from the first cycle.",
        (
            left_out(roles, units),
            *(matrix(roles, error, units[error]) for error in errors),
            *(steadiness(roles, name) for name in roles["models"]),
        ),
        shows=tuple(_worst(roles)),
        not_shown=("Another machine: all roles come from one.", *lost),
    )


def _worst(roles: Mapping[str, Any]) -> list[str]:
    """The role that each model carries over to worst, by the mean ratio of unseen to seen rms."""
    out = []
    for name, model in roles["models"].items():
        ratios: dict[str, list[float]] = {}
        for found in model["rms"].values():
            for role, judged in found.items():
                having = [other for other in found if role not in not_seen(model, other)]
                seen = [found[other][role] for other in having if found[other].get(role)]
                if judged.get(role) and seen:
                    ratios.setdefault(role, []).append(judged[role] / (sum(seen) / len(seen)))
        if ratios:
            mean = {role: sum(values) / len(values) for role, values in ratios.items()}
            worst = max(mean, key=lambda role: mean[role])
            out.append(
                f"{name} carries over worst to '{worst}': {mean[worst]:.2f} times the rms of its fits "
                "that saw it."
            )
        elif model["rms"]:
            out.append(f"{name} is made from recordings of its own: it saw no role in any fold.")
    return out


def _words(table: Table) -> list[int]:
    """Columns of words, which begin at the left."""
    return [k for k in range(1, len(table.header)) if any(isinstance(row[k], str) for row in table.rows)]


def write_page(folder: Path, experiment: Experiment, made: Sequence[Chapter]) -> Path:
    """Write paper.html into a run folder: one file, no network."""
    charts = [chart for one in made for chart in one.charts]
    view = {
        "title": f"{experiment.name}: the paper, figure by figure",
        "source": SOURCE,
        "command": command_of("run", experiment),
        "not_repeated": NOT_REPEATED,
        "chapters": [
            {
                "key": one.key,
                "title": one.title,
                "paper": one.paper,
                "tables": [printed(table, left=_words(table)) for table in one.tables],
                "charts": one.charts,
                "shows": one.shows,
                "not_shown": one.not_shown,
                "failed": one.failed,
            }
            for one in made
        ],
    }
    contents = [("top", "What this is"), *((one.key, one.title.split(":")[0]) for one in made)]
    path = folder / PAGE
    write_atomic(path, fill("paper.html.j2", view, charts, contents))
    return path
