"""The cross-validation over roles as tables: found without / judged on, spread of parameters, terms kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from discovery.evaluation.tables import Table


def matrix(roles: Mapping[str, Any], error: str, unit: str = "") -> Table:
    """rms of one error for every model: a row for each role left out, a column for each role judged on.

    Args:
        roles: "role_matrix" of results.json.

    The figure in brackets was judged on what no part of the fit or the search has seen.
    """
    order = list(roles["recordings"])
    rows: list[tuple[str | float | None, ...]] = []
    for name, model in roles["models"].items():
        for without, judged in model["rms"].get(error, {}).items():
            cells = [_cell(judged.get(role), unseen=role in not_seen(model, without)) for role in order]
            rows.append((name, f"without {without}", *cells))
    label = f"{error} [{unit}]" if unit else error
    return Table(f"{label}: rms; in brackets: left out of fit and search", ("Model", "", *order), tuple(rows))


def not_seen(model: Mapping[str, Any], without: str) -> list[str]:
    """Roles that a fold of a model saw no recording of; runs of earlier versions do not say it."""
    found: list[str] = model.get("unseen", {}).get(without, [without])
    return found


def _cell(value: float | None, *, unseen: bool) -> str | None:
    if value is None or not math.isfinite(value):
        return None
    return f"({value:.3g})" if unseen else f"{value:.3g}"


def left_out(roles: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """One line for each model and error: rms on each role when that role was left out, and the mean of its
    fits on the roles that they saw, if they saw one.
    """
    order = list(roles["recordings"])
    rows: list[tuple[str | float | None, ...]] = []
    for name, model in roles["models"].items():
        for error, found in model["rms"].items():
            unseen = [found.get(role, {}).get(role) for role in order]
            seen = [
                value
                for without, judged in found.items()
                for role, value in judged.items()
                if role not in not_seen(model, without) and value is not None and math.isfinite(value)
            ]
            label = f"{error} [{units[error]}]" if units.get(error) else error
            rows.append((name, label, *unseen, sum(seen) / len(seen) if seen else None))
    header = ("Model", "rms, left out", *order, "seen, mean")
    return Table("Each role left out of fit and search in turn", header, tuple(rows))


def steadiness(roles: Mapping[str, Any], model: str) -> Table:
    """Terms of a model with the share of folds that hold them, and the spread of each parameter."""
    rows: list[tuple[str | float | None, ...]] = []
    for term, found in roles["models"][model]["terms"].items():
        share = f"{100 * found['share']:.0f} %"
        if not found["parameters"]:
            rows.append((term, share, "", None, None, None))
        for name, one in found["parameters"].items():
            sd, mean = one["sd"], one["mean"]
            known = sd is not None and math.isfinite(sd)
            relative = abs(100 * sd / mean) if known and mean else None
            rows.append((term, share, name, mean, sd if known else None, relative))
    header = ("Term", "in folds", "parameter", "mean", "sd over folds", "sd [%]")
    return Table(f"'{model}' over the folds", header, tuple(rows))
