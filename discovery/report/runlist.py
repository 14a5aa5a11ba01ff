"""The list of runs that a comparison opens with: what each found, and how it differs from a chosen one."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discovery.report.heat import subject
from discovery.report.lead import Array, Lead, lead_of
from discovery.report.printed import Against, Line, Printed, behind
from discovery.report.ranking import cells, is_error, ranked, removed, rms_by_unit
from discovery.report.run import Run, pretty_unit
from discovery.report.text import listed, number, percent, words
from discovery.runfolder import made_at

_MOST_DIFFERENCES = 8  # of two runs; the rest is counted
_MOST_NAMES = 4  # in a list that is printed whole
_NOT_SHARED = "no common held-out recording"


def run_list(runs: Sequence[Run], labels: Sequence[str], page: Path) -> Printed:
    """A row for each run, compared with the first; the page lets the reader choose another one.

    Args:
        labels: what each run is called.
        page: folder of the page, for links to the reports of the runs.
    """
    best = [_best(run) for run in runs]
    left = [_left_over(run, model) for run, model in zip(runs, best, strict=True)]
    facts = [_facts(run) for run in runs]
    numbers = range(len(runs))

    def compared(chosen: int, other: int) -> tuple[str, str]:
        if chosen == other:
            return "reference", ""
        lead = _lead(left[chosen], left[other])
        if lead is None and (
            machines := differences(*({"machine": facts[k]["machine"]} for k in (chosen, other)))
        ):
            return _NOT_SHARED, machines[0]  # all else differs, too
        different = differences(facts[chosen], facts[other]) + _moved(runs[chosen], runs[other])
        more = len(different) - _MOST_DIFFERENCES
        different = [*different[:_MOST_DIFFERENCES], f"{more} more"] if more > 1 else different
        return behind(lead) if lead else _NOT_SHARED, "; ".join(different) or "none"

    cells_of = tuple(tuple(compared(chosen, other) for other in numbers) for chosen in numbers)
    rows = tuple(
        Line(
            (label, model or "–", _score(run, model), _verdict(run), *cells_of[0][k]),
            link=_report(run, page),
            about=_about(run),
        )
        for k, (run, label, model) in enumerate(zip(runs, labels, best, strict=True))
    )
    heads = ("rms against {}", "Differences from {}")
    first = tuple(head.format(labels[0]) for head in heads)
    kinds = {is_error(run) for run in runs}
    score = " or ".join(["Error removed (rms)"] * (True in kinds) + ["rms"] * (False in kinds))
    header = ("Run", "Best model", score, "Missing physics", *first)
    return Printed(f"{len(runs)} runs", header, rows, frozenset({1, 3, 5}), Against((4, 5), heads, cells_of))


def differences(chosen: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """What is not the same in two runs, from the chosen one to the other.

    >>> differences({"fit": "a", "file x.csv": "1", "model m": "3 terms"}, {"fit": "a, b", "file x.csv": "2"})
    ['fit: a → a, b', 'x.csv changed', 'without m']
    """
    found: list[str] = []
    for key in dict.fromkeys([*chosen, *other]):
        before, after = chosen.get(key), other.get(key)
        kind, _, name = key.partition(" ")
        if before == after:
            continue
        if kind == "file":
            what = "added" if before is None else "not used" if after is None else "changed"
            found.append(f"{name} {what}")
        elif kind == "model" and before and after:
            found.append(f"{name}: {before} → {after}")
        elif kind == "model":
            found.append(f"with {name}" if after else f"without {name}")
        else:
            found.append(f"{key}: {_changed(before or 'none', after or 'none')}")
    return found


def _changed(before: str, after: str) -> str:
    """Say how a list of names has changed. Of a long list, say only what was added and removed.

    >>> _changed("a, b", "a"), _changed("a, b, c, d, e", "a, b, c, d, x"), _changed("a", "b, c, d, e, f")
    ('a, b → a', 'with x, without e', '1 → 5 others')
    """
    old, new = before.split(", "), after.split(", ")
    if max(len(old), len(new)) <= _MOST_NAMES:
        return f"{before} → {after}"
    if not set(old) & set(new):
        return f"{len(old)} → {len(new)} others"
    more, less = ([n for n in one if n not in other] for one, other in ((new, old), (old, new)))
    said = [
        f"{word} {', '.join(names) if len(names) <= _MOST_NAMES else f'{len(names)} others'}"
        for word, names in (("with", more), ("without", less))
        if names
    ]
    return ", ".join(said)


def _moved(chosen: Run, other: Run) -> list[str]:
    """Fitted parameters of models of the same name whose 95 % intervals do not overlap."""
    found = []
    for name, entry in chosen.results.get("models", {}).items():
        after = other.results.get("models", {}).get(name, {}).get("values") or {}
        for parameter, p in (entry.get("values") or {}).items():
            q = after.get(parameter)
            if q and _apart(p, q):
                unit = pretty_unit(str(q.get("unit", "")))
                found.append(
                    f"{name}, {parameter}: {number(p['value'])} → {number(q['value'])} {unit}".strip()
                )
    return found


def _apart(p: Mapping[str, Any], q: Mapping[str, Any]) -> bool:
    ends = [one.get(end) for one in (p, q) for end in ("low", "high")]
    if any(end is None for end in ends) or p.get("unit") != q.get("unit"):
        return False
    return bool(p["high"] < q["low"] or q["high"] < p["low"])


def _best(run: Run) -> str | None:
    return next((model for model in ranked(run) if cells(run, model)), None)


def _left_over(run: Run, model: str | None) -> dict[tuple[str, str, bytes], Array]:
    """Residuals of a model on held-out recordings, by recording, output and the readings themselves: a
    recording of another machine may have the same name.
    """
    found = {}
    for recording, output in cells(run, model) if model and run.held_out else ():
        data = run.predictions.get(recording)
        if data is not None and output in data.models.get(model or "", {}):
            read = np.isfinite(data.readings[output])
            same = np.stack([data.time[read], data.readings[output][read]]).tobytes()
            found[recording, output, same] = data.left_over(str(model), output)[read]
    return found


def _lead(
    chosen: Mapping[tuple[str, str, bytes], Array], other: Mapping[tuple[str, str, bytes], Array]
) -> Lead | None:
    pairs = [(residual, other[key]) for key, residual in chosen.items() if key in other]
    return lead_of(pairs) if any(mine.size for mine, _ in pairs) else None


def _score(run: Run, model: str | None) -> str:
    """What the best model removes of errors, or its median rms of temperatures."""
    if model is None:
        return "–"
    if is_error(run) and np.isfinite(share := removed(run, model)):
        return f"{number(share, 2)}\u00a0%"
    scored = rms_by_unit(run, model).items()
    return ", ".join(f"{number(float(np.median(rms)), 2)}\u00a0{unit}".strip() for unit, rms in scored) or "–"


def _verdict(run: Run) -> str:
    """Verdict of the diagnosis, with the effects that it names, and those of one's own that it does not."""
    if not run.diagnosis:
        return "no diagnosis"
    lost = [f"{words(word)} searched, not named" for word, named in _own(run).items() if not named]
    return "; ".join([_named(run.diagnosis), *lost])


def _own(run: Run) -> dict[str, bool]:
    """The effects of the experiment file that were searched, and whether each is named."""
    return {str(one["effect"]): bool(one["named"]) for one in (run.diagnosis or {}).get("own_effects") or []}


def _named(diagnosis: Mapping[str, Any]) -> str:
    named = [
        f"{words(str(one['effect']))} ({percent(one.get('probability'))})"
        for one in diagnosis.get("physics") or []
    ]
    if not named:
        return str(diagnosis.get("verdict", "unknown"))
    return listed(list(dict.fromkeys(named))).replace(" %", "\u00a0%")  # an effect at two places: once


def _about(run: Run) -> str:
    """Machine, recordings and day of a run."""
    results = run.results
    parts = ["simulated"] if results.get("simulated") else []
    parts += [str(results["campaign"])] if results.get("campaign") else []
    for said, key in (("fit", "fit"), ("held out", "held_out")):
        if names := results.get(key):
            parts.append(
                f"{said}: {', '.join(names) if len(names) <= _MOST_NAMES else f'{len(names)} recordings'}"
            )
    parts += [made] if (made := made_at(run.folder)) else []
    return " · ".join(parts)


def _report(run: Run, page: Path) -> str:
    report = run.folder / "report.html"
    return Path(os.path.relpath(report, page)).as_posix() if report.exists() else ""


def _facts(run: Run) -> dict[str, str]:
    """What can differ between two runs, by what it is called."""
    results = run.results
    facts = {
        "machine": str(results.get("campaign") or ""),
        "fit": ", ".join(results.get("fit") or []),
        "held out": ", ".join(results.get("held_out") or []),
        "outputs": ", ".join(run.outputs),
        "diagnosed": subject(run) if run.diagnosis else "",
        "own effects": ", ".join(words(word) for word in _own(run)),
    }
    entries: Mapping[str, Mapping[str, Any]] = results.get("models", {})
    for name, entry in entries.items():
        sizes = {word: entry.get(word) for word in ("terms", "parameters")}
        facts[f"model {name}"] = ", ".join(f"{number(size)} {word}" for word, size in sizes.items() if size)
    own = Path(str(results.get("command") or "").rpartition(" ")[2]).name  # the experiment: its name differs
    files = results.get("inputs") or {}
    facts |= {f"file {name}": str(digest) for name, digest in files.items() if name != own}
    return facts | {name: str(one) for name, one in (results.get("versions") or {}).items()}
