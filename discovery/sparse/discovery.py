"""What a discovery hands back."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from discovery.models import Model
from discovery.sparse.choice import Choice


@dataclass(frozen=True)
class PathPoint:
    """One size on the way from sparse to rich: errors on what was left out and fitted, over the noise."""

    outputs: tuple[str, ...]
    terms: int
    left_out_rms: float
    fit_rms: float
    chosen: bool
    names: tuple[str, ...]


@dataclass(frozen=True)
class Discovery:
    """A discovered model and the evidence for it."""

    model: Model
    path: tuple[PathPoint, ...]
    stability: Mapping[str, float]  # "E_Y0C: P_cool through 3600 s" -> share of block bootstraps that keep it
    report: dict[str, Any]


def path_points(
    outputs: Sequence[str], choice: Choice, names: Sequence[str], starts: Collection[str] = ()
) -> tuple[PathPoint, ...]:
    """The sets of a choice as points of its path.

    Args:
        names: (F,) of the families. starts: those of them that are no terms, but where states begin.
    """
    points = []
    for k, one in enumerate(choice.path):
        shown = tuple(names[f] for f in one.members if names[f] not in starts)
        fits = choice.left_out[k], choice.fit[k]
        points.append(PathPoint(tuple(outputs), len(shown), *fits, k == choice.row, shown))
    return tuple(points)


def about_bound(place: str, term: str, asked: float, line: str = "bounds") -> str:
    """A sentence on a bound that binds.

    >>> about_bound("E_Y", "P", -0.013)
    "E_Y: 'bounds' limits the coefficient of 'P'; without this limit, the readings ask for -0.013"
    """
    asks = f"without this limit, the readings ask for {asked:.3g}"
    return f"{place}: '{line}' limits the coefficient of '{term}'; {asks}"


def merged(name: str, parts: Sequence[Model]) -> Model:
    """Models of separate outputs side by side in one; equal time units, no shared names."""
    first = parts[0]
    for part in parts[1:]:
        first = first.with_terms(
            *part.terms, parameters=part.parameters, states=part.states, outputs=part.outputs
        )
    return replace(first, name=name)


def joined(name: str, parts: Sequence[Discovery], seconds: float) -> Discovery:
    """Discoveries of separate outputs as one."""
    path = tuple(point for part in parts for point in part.path)
    stability = {label: share for part in parts for label, share in part.stability.items()}
    report = {
        "groups": [group for part in parts for group in part.report.get("groups", [part.report])],
        "binding": [said for part in parts for said in part.report.get("binding", ())],
        "path": [
            {
                "outputs": list(point.outputs),
                "terms": point.terms,
                "left_out_rms": round(point.left_out_rms, 4),
                "fit_rms": round(point.fit_rms, 4),
                "chosen": point.chosen,
                "names": list(point.names),
            }
            for point in path
        ],
        "stability": {label: round(share, 3) for label, share in stability.items()},
        "seconds": round(seconds, 2),
    }
    return Discovery(merged(name, [part.model for part in parts]), path, stability, report)
