"""Tables of figures: a command measures them and keeps them as JSON, the pages show what is kept.

    python -m benchmarks.tables                    writes the tables of all pages again
    python -m benchmarks.tables runs/nmv5000       keeps the figures of this run first

A page shows the table `damages` between `<!-- table: damages -->` and `<!-- end -->`. A test compares
both: a figure on a page can only be changed by a measurement.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
KEPT = Path(__file__).with_name("measured")
PAGES = (*sorted(ROOT.glob("benchmarks/*.md")), *sorted(ROOT.glob("datasets/*/README.md")))
_SHOWN = re.compile(r"<!-- table: (\w+) -->\n.*?<!-- end -->", re.S)
_OUTPUTS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
_NAMES = {
    "reduced": "eq. (9), T_env, P_drive, T_fluid",
    "superposition": "eq. (8), all at once",
    "one_at_a_time": "eq. (8), one influence at a time",
    "thermobalance": "given thermobalance",
    "discovered": "discovered on the dry thermobalance",
    "black_box": "discovered from the inputs alone (`fit` and `warm_up`)",
    "pysindy": "PySINDy, threshold by cross-validation",
    "regression": "ridge regression on the inputs",
}


def keep(
    name: str, command: str, head: Sequence[str], rows: Sequence[Sequence[object]], after: str = ""
) -> None:
    """Store the figures of today. `after`: a sentence that holds figures of the table."""
    found = {
        "measured": date.today().isoformat(),
        "command": command,
        "head": list(head),
        "rows": [[str(cell) for cell in row] for row in rows],
        "after": after,
    }
    KEPT.mkdir(exist_ok=True)
    (KEPT / f"{name}.json").write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", "utf-8")


def table(name: str) -> str:
    """When and how the figures were measured, and the figures."""
    found = json.loads((KEPT / f"{name}.json").read_text("utf-8"))
    rows = [found["head"], ["---"] * len(found["head"]), *found["rows"]]
    lines = [f"| {' | '.join(row)} |".replace("|  |", "| |") for row in rows]
    after = ["", found["after"]] if found["after"] else []
    return "\n".join([f"Measured {found['measured']} with `{found['command']}`.", "", *lines, *after])


def shown(text: str) -> str:
    """A page with its tables as they are kept."""
    return _SHOWN.sub(lambda m: f"<!-- table: {m[1]} -->\n{table(m[1])}\n<!-- end -->", text)


def keep_run(folder: Path) -> None:
    """Figures of `discovery run experiments/nmv5000.toml`."""
    results = json.loads((folder / "results.json").read_text("utf-8"))
    command = "discovery run experiments/nmv5000.toml"
    models: dict[str, dict[str, Any]] = results["models"]
    held_out = results["held_out"]

    def rms(model: str, recording: str) -> str:
        return ", ".join(f"{models[model]['recordings'][recording][y]['rms']:.2f}" for y in _OUTPUTS)

    head = ["model", f"{held_out[0]} {', '.join(y.removeprefix('E_') for y in _OUTPUTS)}", *held_out[1:]]
    rows = [[name, *(rms(model, r) for r in held_out)] for model, name in _NAMES.items() if model in models]
    keep("virtual_machine", command, head, rows, f"The command took {results['seconds']:.0f} s.")
    given = models["thermobalance"]["recordings"]
    seen = [*results["fit"], *held_out]
    keep(
        "thermobalance",
        command,
        ["", *(f"`{r}`" for r in seen)],
        [[y, *(f"{given[r][y]['rms']:.2f} ({_removed(given[r][y]):.0f} %)" for r in seen)] for y in _OUTPUTS],
    )


def _removed(one: dict[str, Any]) -> float:
    """Share of the rms without a model that is gone, in percent."""
    return 100.0 * float(1.0 - one["rms"] / one["uncompensated"]["rms"])


def main(run: str | None = None) -> None:
    """Keep the figures of a run, if one is named, and write all pages."""
    if run:
        keep_run(Path(run))
    for page in PAGES:
        text = page.read_text("utf-8")
        page.write_text(shown(text), "utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:2])
