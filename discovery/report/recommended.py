"""Which model to use: the overall best one, and for which outputs another one is better."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from discovery.report.printed import Line, Printed
from discovery.report.ranking import rms_unit
from discovery.report.run import Run
from discovery.report.text import listed, number, with_unit


def recommended(run: Run, best: str) -> str:
    """For which outputs the overall best model wins, ties or loses; empty where nothing can be compared.

    Args:
        best: the model that is best over all outputs.
    """
    found = _found(run)
    wins = [output for output, one in found.items() if one["model"] == best and not one["ties"]]
    loses = [output for output, one in found.items() if best not in (one["model"], *one["ties"])]
    ties = [output for output in found if output not in wins and output not in loses]
    parts = []
    if wins:
        parts.append(f"It is clearly the best for {listed(wins)}.")
    if ties:
        parts.append(f"For {listed(ties)} alone, the recordings do not separate it from other models.")
    parts += [f"For {output}, “{found[output]['model']}” is better." for output in loses]
    return " ".join(parts)


def table(run: Run) -> Printed | None:
    """The best model for each output and its lead over each other one; None where nothing can be compared."""
    found = _found(run)
    if not found:
        return None
    rows = []
    for output, one in found.items():
        rivals = sorted(one["against"].items(), key=lambda item: float(item[1]["rms"]))
        nearest = next((pair for pair in rivals if pair[0] not in one["ties"]), None)
        rows.append(
            Line(
                (
                    with_unit(output, rms_unit(run, output)),
                    one["model"],
                    number(float(one["rms"])),
                    ", ".join(one["ties"]) or "none",
                    _lead(*nearest) if nearest else "–",
                )
            )
        )
    header = (
        "Output",
        "Best model",
        "rms",
        "Not separated from it",
        "Lead over the next separated one (95 % interval)",
    )
    return Printed(
        "Best model for each output, held-out recordings", header, tuple(rows), frozenset({1, 3, 4})
    )


def _found(run: Run) -> Mapping[str, Mapping[str, Any]]:
    return (run.results.get("recommended") or {}) if run.held_out else {}


def _lead(name: str, one: Mapping[str, Any]) -> str:
    """How much smaller the rms of the best model is, with its interval."""
    low, high = (number(-float(one[end]), 2) for end in ("high", "low"))
    return f"{number(-float(one['difference']), 2)} % less rms than {name} ({low} to {high} %)"
