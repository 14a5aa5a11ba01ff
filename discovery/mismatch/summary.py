"""A diagnosis in a few lines for the terminal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def summary(path: Path) -> list[str]:
    """Lines that say what a diagnosis.json says."""
    d: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    lines = [f"{d['verdict']}: what '{d['model']}' leaves out"]
    for p in d["physics"]:
        sizes = ", ".join(
            f"{name} = {q['value']:.4g} {q['unit']}"
            + (f" ({q['low']:.4g} to {q['high']:.4g})" if q["low"] != q["high"] else "")
            for name, q in p["parameters"].items()
            if q["low"] is not None
        )
        lines.append(
            f"  {p['effect']} at {', '.join(p['states'])}, probability {p['probability']:.2f}: {sizes}"
        )
    near = [a for a in d["alternatives"] if a["log_evidence_below_best"] <= 3]
    lines += [f"  could also be {a['effect']} at {', '.join(a['states'])}" for a in near]
    lines += [f"  {reason}" for reason in d["reasons"]]
    if about := d["description"]:
        what = f"the missing heat at {about['state']} follows {about['formula']}"
        lines.append(f"  {what} (a description, not a cause)")
    for run, i in d["improvement"]["held_out"].items() if d["physics"] else ():
        rms = f"rms {i['rms_before']:.3g} -> {i['rms_after']:.3g} (noise {i['noise_floor']:.3g})"
        lines.append(f"  unseen recording {run}: {rms}")
    lines.append(f"  next: {d['next_experiment']}")
    return lines
