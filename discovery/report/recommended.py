"""The first sentence: which model to take for each output, by what no fit has seen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from discovery.report.run import Run
from discovery.report.text import listed, number


def recommended(run: Run, where: str) -> str:
    """One sentence by output: the best model with its lead over the next that does not tie; a tie says tie.

    Empty where nothing was held out or nothing can be compared.

    Args:
        where: "on the unseen recording ...".
    """
    found: Mapping[str, Mapping[str, Any]] = run.results.get("recommended") or {}
    if not found or not run.held_out:
        return ""
    clear: dict[str, list[str]] = {}
    tied: dict[tuple[str, ...], list[str]] = {}
    for output, one in found.items():
        if one["ties"]:
            tied.setdefault((one["model"], *one["ties"]), []).append(output)
        else:
            clear.setdefault(one["model"], []).append(f"{output} ({_lead(one)})")
    parts = [f"“{model}” predicts {listed(outputs)} best" for model, outputs in clear.items()]
    parts += [f"{listed([f'“{m}”' for m in models])} tie for {listed(o)}" for models, o in tied.items()]
    whole = f"{where[0].upper()}{where[1:]}"
    return f"{whole}, {'; '.join(parts)}."


def _lead(one: Mapping[str, Any]) -> str:
    """How much less the best model leaves than the next one, with its interval."""
    name, next_best = min(one["against"].items(), key=lambda item: float(item[1]["rms"]))
    low, high = (number(-float(next_best[end]), 2) for end in ("high", "low"))
    return f"{number(-float(next_best['difference']), 2)} % less rms than “{name}”, 95 %: {low} to {high} %"
