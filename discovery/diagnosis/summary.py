"""A diagnosis in a few lines for the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from discovery.diagnosis.thresholds import RIVAL, SHARE
from discovery.printed import printed, undetermined, when
from discovery.runfolder import read_diagnosis

_NOISE = "reading noise and heat that nobody records explain"
_OFF = "reading noise, heat that nobody records and flows that are off by {:.0f} % explain"
_COARSE = "reading noise and process noise as large as this model needs explain"
_OPEN = 1.5  # times the noise: from there on, the uncertainty of the parameters is said


def summary(folder: Path) -> list[str]:
    """Lines for the terminal about the diagnosis.json of a folder."""
    return lines_of(read_diagnosis(folder))


def lines_of(d: dict[str, Any]) -> list[str]:
    """Lines for the terminal about the content of a diagnosis.json."""
    lines = [f"{d['verdict']} in '{d['model']}'"]
    for p in d["physics"]:
        sizes = ", ".join(_size(name, q) for name, q in p["parameters"].items() if _is_known(q, p))
        said = f"  {p['effect']} {_place(p)}, probability {p['probability']:.2f}"
        if p.get("together"):
            said += f" ({p['together']:.2f} that it or what it could also be acts)"
        lines.append(f"{said}: {sizes}" if sizes else said)
    near = [a for a in d["alternatives"] if a["log_evidence_below_best"] <= RIVAL]
    lines += [f"  could also be {a['effect']} {_place(a)}" for a in near]
    lines += [f"  {reason}" for reason in d["reasons"]]
    if about := d["description"]:
        what = f"the missing heat at {about['state']} follows {about['formula']}"
        lines.append(f"  {what} (a description, not a cause)")
    lines += [f"  {one['sentence']}" for one in d.get("responses") or ()]
    unit, noise = _unit(d["improvement"]), _noise(d)
    worse = {_held_out(run) for run in d["improvement"]["contradicted_by"]}
    for which, i in _runs(d["improvement"]) if d["physics"] else ():
        after = "runs away" if i["rms_after"] is None else printed(i["rms_after"])
        rms = f"rms {printed(i['rms_before'])} -> {after}{unit} ({_by_noise(i, unit, noise)})"
        rms += ", worse than without" if which in worse else _otherwise(i, unit)
        lines.append(f"  {which}: {rms}")
    if not d["physics"]:
        lines += _left(d["improvement"], noise)
    lines.append(f"  next: {d['next_experiment']}")
    return lines


def _noise(d: dict[str, Any]) -> str:
    """What the noise of an answer is. Where nothing explains a mismatch, process noise stands for what the
    model lacks: it is no heat.
    """
    if d["verdict"] == "unexplained":
        return _COARSE
    share = (d.get("detection") or {}).get("form_error") or 0.0
    return _OFF.format(100 * share) if share >= SHARE else _NOISE


def _otherwise(one: dict[str, Any], unit: str) -> str:
    """The rms with start values from all readings, if it says the opposite of the rms from the first ones."""
    before, after = one.get("from_known_starts") or (None, None)
    if before is None or after is None or one["rms_after"] is None:
        return ""
    if (after - before) * (one["rms_after"] - one["rms_before"]) >= 0:
        return ""
    rms = f"rms {printed(before)} -> {printed(after)}{unit}"
    return f"; with start values from all readings, {rms}, and this one decides"


def _left(improvement: dict[str, Any], noise: str) -> list[str]:
    """rms of free runs of the model, and the rms that noise explains. `noise`: what it is."""
    unit = _unit(improvement)
    return [
        f"  {which}: rms {printed(i['rms_before'])}{unit} ({_by_noise(i, unit, noise)}){_by_start(i, unit)}"
        for which, i in _runs(improvement)
    ]


def _runs(improvement: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Free runs of the model that have an rms, with what they are."""
    held_out = {_held_out(run): i for run, i in improvement["held_out"].items()}
    runs = {"recordings to fit": improvement["fit"]} | held_out
    return [(which, i) for which, i in runs.items() if i["rms_before"] is not None]


def _held_out(run: str) -> str:
    return f"held-out recording {run}"


def _by_start(one: dict[str, Any], unit: str) -> str:
    """The rms with start values from all readings, where most of the rms from the first ones is how the
    recording began: that one decides.
    """
    begun, expected = (one.get("from_known_starts") or [None])[0], one.get("expected") or one["noise_floor"]
    if begun is None or one["rms_before"] < _OPEN * max(begun, expected):
        return ""
    return f"; with start values from all readings rms {printed(begun)}{unit}, and this one decides"


def _by_noise(one: dict[str, Any], unit: str, noise: str) -> str:
    """What noise explains of an rms, and the uncertainty of the parameters where it explains much more; where
    noise explains all of it, its size says nothing more.
    """
    floor, rms = one["noise_floor"], (one["rms_before"], one["rms_after"])
    if all(r is not None and r < floor for r in rms):
        return f"{noise} all of it"
    expected = one.get("expected") or floor
    unsure = f", with what the fit leaves open {printed(expected)}{unit}" if expected > _OPEN * floor else ""
    if expected > max(r or 0.0 for r in rms):
        unsure = "; parameters that the fit leaves open explain the rest" if unsure else ""
    return f"{noise} up to {printed(floor)}{unit}{unsure}"


def _unit(improvement: dict[str, Any]) -> str:
    """The unit of the proof, to be printed behind a number."""
    unit = improvement.get("unit") or "1"
    return "" if unit == "1" else f" {unit}"


def _place(claim: dict[str, Any]) -> str:
    """Where an effect acts, from which input, in which recording."""
    states = claim.get("moved") or claim["states"]
    places = [f"at {', '.join(states)}"] if states else []
    places += [f"from {', '.join(claim['channels'])}"] if claim.get("channels") else []
    places += [when(claim)] if claim.get("recording") else []
    return " ".join(places) or "in all recordings"


def _is_known(q: dict[str, Any], claim: dict[str, Any]) -> bool:
    """Whether a parameter is printed: not a switch that is fixed at 1, nor a jump that may be zero."""
    if claim.get("moved") and q.get("output", claim["moved"][0]) not in claim["moved"]:
        return False
    switch = q["unit"] == "1" and q["low"] == q["value"] == q["high"] == 1.0
    return q["low"] is not None and not switch


def _size(name: str, q: dict[str, Any]) -> str:
    """A parameter with its unit, the speed at which it is stated, and its 95 % interval."""
    unit = "" if q["unit"] == "1" else f" {q['unit']}"
    unit += f" at {q['at']}" if q.get("at") else ""
    ends = f"{printed(q['low'], 4)} to {printed(q['high'], 4)}"
    interval = f" ({ends}{undetermined(q['low'], q['high'])})" if q["low"] != q["high"] else ""
    if known := q.get("ratio"):
        ends = f"{printed(known['low'], 4)} to {printed(known['high'], 4)}"
        interval = f" (not determined; {name}/{known['to']} = {printed(known['value'], 4)}, {ends})"
    return f"{name} = {printed(q['value'], 4)}{unit}{interval}"
