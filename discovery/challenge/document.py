"""The content of a challenge's results.json, and the same as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from discovery.challenge.intervals import Share
from discovery.challenge.lines import LINES, behind, figure, rows, with_interval
from discovery.challenge.methods import WORKBENCH
from discovery.challenge.scoring import FALSE_ALARM, WRONG, WRONG_KIND
from discovery.challenge.tally import Scored, Tally, by_family
from discovery.virtual.families import CHOSEN_ON


def document(
    seal: Mapping[str, Any], changed: Sequence[str], failures: Mapping[str, str], tallies: Mapping[str, Tally]
) -> dict[str, Any]:
    """Everything that was found. `changed`: source files that are not what was sealed."""
    ours = tallies[WORKBENCH]
    return {
        "cases": len(ours.scored),
        "sealed": {key: seal[key] for key in ("sealed", "version", "commit", "answers")},
        "changed_since_sealed": list(changed),
        "failures": dict(failures),
        "methods": {name: _figures(t) for name, t in tallies.items()},
        "families": {
            name: {"settings_chosen_on": name in CHOSEN_ON, "cases": len(t.scored)} | _figures(t)
            for name, t in by_family(ours).items()
        },
        "behind": behind(tallies),
        "verdicts": ours.verdicts,
        "confusion": ours.confusion,
        "power": [vars(b) for b in ours.power],
        "reliability": [{"said": r.said, **_share(r.true)} for r in ours.reliability],
        "judged": [_case(s) for s in ours.scored],
    }


def _figures(t: Tally) -> dict[str, Any]:
    out: dict[str, Any] = {"words": dict(t.words), "failed": t.failed}
    for line in LINES:
        out[line.title] = {
            "value": line.value(t),
            "unit": line.unit,
            **({"target": line.target, "reached": line.reached(t)} if line.target is not None else {}),
            **(_share(line.count(t)) if line.count else {}),
        }
    out["false alarms, upper bound"] = {"value": 100 * t.false_alarms.upper(), "unit": "%", "level": 0.95}
    return out


def _share(s: Share) -> dict[str, Any]:
    low, high = s.interval()
    return {"hits": s.hits, "count": s.count, "low": 100 * low, "high": 100 * high}


def _case(s: Scored) -> dict[str, Any]:
    return {
        "case": s.case,
        "kind": s.key["kind"],
        "truth": truth_of(s.key),
        "size": s.key.get("rms_over_noise"),
        "verdict": s.verdict,
        "named": [
            {"effect": f["effect"], "states": list(f["states"]), "probability": f.get("probability")}
            for f in s.named
        ],
        "points": s.judgement.points,
        "word": s.judgement.word,
        "explained": (s.answer or {}).get("improvement", {}).get("explained"),
        "seconds": (s.answer or {}).get("seconds"),
    }


def truth_of(key: Mapping[str, Any]) -> str:
    """A key in words."""
    if "effects" in key:
        return " and ".join(truth_of(e) for e in key["effects"])
    if key["effect"] is None:
        return "no effect"
    place = " and ".join([*key["states"], *([key["output"]] if "output" in key else [])])
    return f"{key['effect']}@{place}" if place else str(key["effect"])


def said(s: Scored) -> str:
    """An answer in words."""
    return (
        " and ".join(
            f"{f['effect']}@{'+'.join(f['states'])}" + (f" ({p:.2f})" if (p := f.get("probability")) else "")
            for f in s.named
        )
        or s.verdict
    )


def wrong(t: Tally) -> list[Scored]:
    """Cases with a false alarm or a wrong name."""
    return [s for s in t.scored if s.judgement.word in (FALSE_ALARM, WRONG, WRONG_KIND)]


def markdown(tallies: Mapping[str, Tally], seal: Mapping[str, Any]) -> str:
    """The comparison, power and reliability as Markdown."""
    ours = tallies[WORKBENCH]
    quiet = ours.false_alarms
    lead = " In brackets: the lead of the workbench over each other method (− behind)."
    parts = [
        f"{len(ours.scored)} concealed cases, sealed {seal['sealed']} (answers {seal['answers'][:16]}…, "
        f"version {seal['version']}, commit {str(seal['commit'])[:10]}).{lead * (len(tallies) > 1)}",
        _table(rows(tallies)),
        f"False alarms: {quiet.hits:g} of {quiet.count}; with 95 % certainty the rate is below "
        f"{100 * quiet.upper():.1f} %.",
        *_families(ours),
        _table([["size", "cases", "detected", "named", "right, of those named"], *power_rows(ours)]),
        _table([["probability said", "came true", "named effects"], *reliability_rows(ours)]),
    ]
    return "\n\n".join(parts) + "\n"


def _families(t: Tally) -> list[str]:
    rows = family_rows(t)
    return [_table(rows), CHOSEN] if rows else []


CHOSEN = (
    "Settings were chosen on the families that say so, and on practice cases of five-axis tables from other "
    "generators; the others only confirm."
)
_BY_FAMILY = (
    "points a case, −2 to 1",
    "false alarms, of cases without effect",
    "out of catalogue, wrongly named",
    "one effect of size ≥ 1: named",
    "all effects of the catalogue: right, of those named",
    "seconds a case, median",
)


def family_rows(t: Tally) -> list[list[str]]:
    """The main figures of each family as cells, a head first; nothing where no family is known."""
    lines = [line for line in LINES if line.title in _BY_FAMILY]
    rows = [
        [
            name.replace("_", " "),
            "chosen on it" if name in CHOSEN_ON else "confirms",
            str(len(one.scored)),
            *(with_interval(line, one) for line in lines),
        ]
        for name, one in by_family(t).items()
    ]
    return [["family", "settings", "cases", *(line.title for line in lines)], *rows] if rows else []


def power_rows(t: Tally) -> list[list[str]]:
    """Power against size as cells."""
    return [
        [f"{b.size:g}", str(b.count), _of(b.detected, b.count), _of(b.named, b.count), _of(b.right, b.named)]
        for b in t.power
    ]


def reliability_rows(t: Tally) -> list[list[str]]:
    """Calibration as cells."""
    return [
        [figure(100 * r.said, "%"), figure(r.true.percent, "%"), str(r.true.count)] for r in t.reliability
    ]


def _of(part: int, whole: int) -> str:
    return f"{100 * part / whole:.0f} %" if whole else "–"


def _table(cells: Sequence[Sequence[str]]) -> str:
    head, *body = cells
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def summary(tallies: Mapping[str, Tally]) -> list[str]:
    """What the terminal shows below the table: every wrong answer."""
    return [
        f"{s.case}: {s.judgement.word}; truth {truth_of(s.key)}, said {said(s)}"
        for s in wrong(tallies[WORKBENCH])
    ]
