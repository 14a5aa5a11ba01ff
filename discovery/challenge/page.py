"""The report of a challenge: one page that opens offline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from discovery import __version__
from discovery.challenge.document import (
    CHOSEN,
    family_rows,
    power_rows,
    reliability_rows,
    said,
    truth_of,
    wrong,
)
from discovery.challenge.figures import KINDS, all_figures
from discovery.challenge.lines import LINES, behind, rows
from discovery.challenge.methods import WORKBENCH
from discovery.challenge.scoring import NEAR, RIGHT
from discovery.challenge.tally import Scored, Tally
from discovery.printed import counted

_HERE = Path(__file__).parent


def render(seal: Mapping[str, Any], changed: Sequence[str], tallies: Mapping[str, Tally]) -> str:
    """The page as HTML."""
    from markupsafe import Markup

    from discovery.report.page import style, templates

    ours = tallies[WORKBENCH]
    charts = [{**f, "svg": Markup(f["svg"])} for f in all_figures(tallies, ours)]
    return (
        templates(_HERE)
        .get_template("page.html.j2")
        .render(
            css=style(),
            version=__version__,
            headline=headline(ours),
            figures=_figures(ours),
            table=rows(tallies),
            aims={line.title: line.reached(ours) for line in LINES},
            charts=[c for c in charts if not c.get("wide")],
            wide=[c for c in charts if c.get("wide")],
            behind=behind(tallies),
            families=family_rows(ours),
            chosen=CHOSEN,
            power=power_rows(ours),
            reliability=reliability_rows(ours),
            wrong=[_row(s) for s in wrong(ours)],
            cases=[_row(s) for s in ours.scored],
            seal=seal,
            changed=list(changed),
            upper=f"{100 * ours.false_alarms.upper():.1f} %",
            quiet=ours.false_alarms,
        )
    )


def headline(t: Tally) -> str:
    """The answer in a sentence."""
    right = t.words.get(RIGHT, 0)
    alarms = int(t.false_alarms.hits)
    return (
        f"{right} of {counted(len(t.scored), 'concealed case')} answered right, "
        f"{counted(alarms, 'false alarm')}, {counted(len(wrong(t)) - alarms, 'wrong name')}"
    )


def _figures(t: Tally) -> list[tuple[str, str]]:
    picked = [line for line in LINES if line.target is not None and line.value(t) is not None]
    return [
        (
            f"{line.value(t):.1f} {line.unit}",
            f"{line.title} (aim {'≥' if line.sign > 0 else '≤'} {line.target:g})",
        )
        for line in picked
    ]


def _row(s: Scored) -> dict[str, Any]:
    answer = s.answer or {}
    gap = (answer.get("improvement") or {}).get("explained")
    rivals = [a for a in answer.get("alternatives", ()) if a["log_evidence_below_best"] <= NEAR]
    return {
        "case": s.case,
        "kind": KINDS.get(str(s.key["kind"]), s.key["kind"]),
        "truth": truth_of(s.key),
        "size": f"{s.key['rms_over_noise']:.2f}" if "rms_over_noise" in s.key else "",
        "said": said(s),
        "rivals": ", ".join(f"{a['effect']}@{'+'.join(a['states'])}" for a in rivals),
        "word": s.judgement.word,
        "points": f"{s.judgement.points:+.2f}".replace("-", "−"),
        "look": "yes" if s.judgement.points >= 1 else "no" if s.judgement.points < 0 else "",
        "explained": "" if gap is None else f"{100 * gap:.0f} %".replace("-", "−"),
        "seconds": "" if answer.get("seconds") is None else f"{answer['seconds']:.1f}",
        "reasons": "; ".join(answer.get("reasons") or ()) if s.verdict == "unexplained" else "",
    }
