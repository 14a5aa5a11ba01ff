"""The section on what a model left out."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from discovery.printed import undetermined, when
from discovery.report.heat import heat_charts, heat_unit, subject, unit_of
from discovery.report.printed import Line, Printed
from discovery.report.ranking import rms_unit
from discovery.report.run import Run, pretty_unit
from discovery.report.text import listed, number, percent, with_unit, words

_MOST_RIVALS = 6
NEAR = 3.0  # log evidence below which a rival is not excluded: `thresholds.RIVAL`, not loaded here
_HEAT_NOTE = (
    "The heat that would remove the residual, whatever its cause: over time, and against each input and "
    "state (band: 95 %). A quantity that this heat follows is a candidate for the missing physics."
)


def leads(run: Run) -> bool:
    """Whether the diagnosis found something: then it opens the page, before the comparison of models."""
    return (run.diagnosis or {}).get("verdict") not in (None, "no mismatch")


def section(run: Run) -> dict[str, Any] | None:
    """Texts, tables and charts of the diagnosis; None where there is none."""
    d = run.diagnosis
    if not d:
        return None
    tables = [_physics(d), _proof(d), _outputs(run, d), _windows(run, d), _rivals(d), _considered(d)]
    return {
        "about": _about(run, d),
        "reasons": [_sentence(_in_words(str(one))) for one in d.get("reasons") or []],
        "tables": [table for table in tables if table.rows],
        "charts": heat_charts(run),
        "heat_note": _HEAT_NOTE,
        "descriptions": _descriptions(d),
        "next": _sentence(d.get("next_experiment") or ""),
        "next_title": "What would have been detected"
        if d.get("verdict") == "no mismatch"
        else "Next experiment",
    }


def _sentence(text: str) -> str:
    """A text with a capital at its start and a full stop at its end."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}." if text else ""


def _in_words(text: str) -> str:
    """A text with the effects of the catalogue as plain words."""
    from discovery.effects.catalogue import catalogue

    for effect in sorted({one.word for one in catalogue().values()}, key=len, reverse=True):
        text = re.sub(rf"\b{effect}\b", words(effect), text)
    return text


def _about(run: Run, d: Mapping[str, Any]) -> str:
    text = f"Verdict on “{subject(run)}”: {d.get('verdict', 'unknown')}."
    location = d.get("location") or {}
    if location.get("regime"):
        text += f" The mismatch appears where {_with_units(run, location['regime'])}."
    if location.get("alike"):
        groups = listed([listed(group) for group in location["alike"]], "; and")
        text += f" These readings do not separate heat at {groups}."
    return text


def _with_units(run: Run, rule: str) -> str:
    """A rule over inputs and states with the units of its numbers: flow > 2 l/min."""
    return re.sub(
        r"(\w+) ([<>]=?) (\S+)",
        lambda found: f"{found[1]} {found[2]} {found[3]} {unit_of(run, found[1])}".rstrip(),
        rule,
    )


def sizes(one: Mapping[str, Any]) -> list[str]:
    """The parameters of an effect that was found, each with its interval; a switch that is on is no size, nor
    is a jump that may be none.
    """
    moved = one.get("moved") or one.get("states") or []
    return [
        f"{name} = {number(p.get('value'))} {pretty_unit(str(p.get('unit', '')))} {_speed(p)}"
        f"({_interval(name, p)})"
        for name, p in (one.get("parameters") or {}).items()
        if p.get("low") != p.get("high") and p.get("output") in (None, *moved)
    ]


def _interval(name: str, size: Mapping[str, Any]) -> str:
    """The interval of a size, or of its ratio to another parameter, where that alone is known."""
    if known := size.get("ratio"):
        ends = f"95 %: {number(known.get('low'))} to {number(known.get('high'))}"
        return f"not determined; {name}/{known['to']} = {number(known.get('value'))}, {ends}"
    low, high = size.get("low"), size.get("high")
    return f"95 %: {number(low)} to {number(high)}{undetermined(low, high)}"


def _speed(size: Mapping[str, Any]) -> str:
    return f"at {size['at']} " if size.get("at") else ""


def _place(one: Mapping[str, Any]) -> str:
    """Return bodies, inputs, recording and hours of an effect. A shifted clock only has a recording."""
    places = listed(one.get("moved") or one.get("states") or [])
    parts = [
        places,
        f"from {listed(one['channels'])}" if one.get("channels") else "",
        when(one) if one.get("recording") else "",
        _hours(one),
    ]
    return " ".join(part for part in parts if part) or "in all recordings"


def _hours(one: Mapping[str, Any]) -> str:
    """When an event acts."""
    times = one.get("instants_s") or []
    if not times:
        return ""
    scale, unit = (3600.0, "h") if max(times) > 3600 else (60.0, "min")
    said = " to ".join(number(t / scale) for t in times)
    return f"({said} {unit})"


def _physics(d: Mapping[str, Any]) -> Printed:
    rows = []
    for one in d.get("physics") or []:
        cells = (
            words(one["effect"]),
            _place(one),
            percent(one.get("probability"))
            + (f" ({percent(one['together'])} with its rivals)" if one.get("together") else ""),
            "; ".join(one.get("expressions") or [one.get("expression") or ""]),
            "; ".join(sizes(one)),
        )
        rows.append(Line(cells))
    header = ("Effect", "Where", "Probability", "Term", "Size")
    return Printed("What the repaired model adds", header, tuple(rows), frozenset({1, 3, 4}))


def _proof(d: Mapping[str, Any]) -> Printed:
    improvement = d.get("improvement") or {}
    parts = {"fitted": improvement.get("fit") or {}} | {
        f"{name} (held out)": one for name, one in (improvement.get("held_out") or {}).items()
    }
    rows = [
        Line(
            (
                name,
                number(one["rms_before"]),
                "diverges" if one.get("runs_away") else number(one.get("rms_after")),
                number(one.get("noise_floor")),
                _gain(one),
            )
        )
        for name, one in parts.items()
        if one.get("rms_before") is not None and one.get("rms_before") != one.get("rms_after")
    ]
    unit = pretty_unit(improvement.get("unit") or "")
    header = ("Recording", "rms before", "rms after", "rms of the noise", "Improvement (95 %)")
    return Printed(
        with_unit(
            "Free runs before and after the repair: rms over all outputs, each weighted by its noise", unit
        ),
        header,
        tuple(rows),
    )


def _gain(one: Mapping[str, Any]) -> str:
    return "" if one.get("gain_low") is None else f"{number(one['gain_low'])} to {number(one['gain_high'])}"


def _outputs(run: Run, d: Mapping[str, Any]) -> Printed:
    detection, shares = d.get("detection") or {}, (d.get("location") or {}).get("outputs") or {}
    noise = detection.get("noise") or {}
    runs = ((d.get("improvement") or {}).get("fit") or {}).get("outputs") or {}  # the runs of the table above
    rms = {name: before for name, (before, _) in runs.items()}
    sharing = leads(run)
    rows = [
        Line(
            (
                with_unit(name, rms_unit(run, name)),
                number(noise.get(name)),
                number(rms.get(name)),
                *([percent(shares.get(name))] if sharing else []),
            )
        )
        for name in dict.fromkeys([*rms, *noise, *shares])
    ]
    return Printed(
        "Mismatch by output: free runs of the fitted recordings before the repair, not weighted",
        ("Output", "Reading noise", "rms before", *(["Share of the mismatch"] if sharing else [])),
        tuple(rows),
    )


def _windows(run: Run, d: Mapping[str, Any]) -> Printed:
    windows = (d.get("location") or {}).get("windows") or []
    long = any((w.get("end_s") or 0.0) > 3 * 3600 for w in windows)
    scale, unit = (3600.0, "h") if long else (60.0, "min")

    def at(seconds: float | None) -> str:
        return number(None if seconds is None else seconds / scale)

    rows = [
        Line(
            (
                str(w.get("recording")),
                at(w.get("start_s")),
                at(w.get("end_s")),
                str(w.get("state") or ""),
                number(w.get("heat_W")),
            )
        )
        for w in windows
    ]
    heat = heat_unit(run)
    header = (
        "Recording",
        f"From [{unit}]",
        f"To [{unit}]",
        "Body",
        with_unit("Missing heat" if heat == "W" else "Missing rate", heat),
    )
    return Printed("When heat is missing", header, tuple(rows), frozenset({3}))


def _rivals(d: Mapping[str, Any]) -> Printed:
    rows = []
    for one in (d.get("alternatives") or [])[:_MOST_RIVALS]:
        below = one["log_evidence_below_best"]
        judged = "not excluded" if below <= NEAR else "less likely" if below < 10 else "ruled out"
        rows.append(Line((words(one["effect"]), _place(one), number(below), judged)))
    return Printed(
        "Rivals",
        ("Effect", "Where", "Log evidence below best", "With these recordings"),
        tuple(rows),
        frozenset({1, 3}),
    )


def _considered(d: Mapping[str, Any]) -> Printed:
    """Return the highest scores of the search if nothing was named. Else the rivals say more."""
    if d.get("physics") or d.get("verdict") == "no mismatch":
        return Printed("", (), ())
    best: dict[tuple[str, str], Mapping[str, Any]] = {}
    for c in d.get("considered") or []:  # best first
        best.setdefault((words(c["effect"]), _place(c)), c)
    rows = [
        Line((*named, number(c.get("log_evidence")), percent(c.get("share_that_a_refit_leaves"))))
        for named, c in best.items()
    ]
    header = ("Effect", "Where", "Log evidence", "Share not explained by other parameters")
    return Printed("Closest effects of the catalogue", header, tuple(rows), frozenset({1, 3}))


def _descriptions(d: Mapping[str, Any]) -> list[str]:
    """What describes a mismatch without a name: missing heat, and outputs that follow inputs."""
    heat, said = d.get("description") or {}, []
    if heat.get("formula"):
        said = [f"{heat['formula']} at {heat.get('state')} describes the missing heat; it is not its cause."]
    return [*said, *(_sentence(one["sentence"]) for one in d.get("responses") or ())]
