"""A campaign of one body, small enough to be fitted in a second."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

CAMPAIGN = """
name = "small"

[channels]
T_env = { role = "ambient temperature", unit = "degC" }
P     = { role = "heat load", unit = "W" }
E_Y0C = { role = "error", unit = "um", noise = 0.3 }
E_R0T = { role = "error", unit = "um", noise = 0.3 }

[recordings]
a = { file = "a.csv" }
b = { file = "b.csv" }
c = { file = "c.csv" }
"""

MODEL = """
name = "one body"

[parameters]
G    = { start = 10.0, unit = "W/K", min = 0.0 }
loss = { start = 0.5, unit = "1", min = 0.0 }

[states]
body = { capacity = 60e3, start = "T_env" }

[[terms]]
into = "body"
expression = "G*(T_env - body)"

[[terms]]
into = "body"
expression = "loss*P"

[outputs]
E_Y0C = "-5*(body - 22)"
E_R0T = "2*(body - 22)"
"""

EXPERIMENT = """
name = "small"
campaign = "campaign.toml"
fit = ["a", "b"]
held_out = ["c"]

[models]
reduced       = { kind = "reduced" }
superposition = { kind = "superposition", inputs = ["T_env", "P"] }
one_body      = { file = "model.toml" }
"""


def write_recording(path: Path, seed: int) -> None:
    """24 h of the body of MODEL with G = 12 W/K and loss = 0.4; readings every 15 minutes, 0.3 um noise."""
    rng = np.random.default_rng(seed)
    lines, x, room, power = ["time,T_env,P,E_Y0C,E_R0T"], 22.0, 22.0, 0.0
    for k in range(24 * 12 + 1):
        if k % 12 == 0:
            power = float(rng.choice([0.0, 100.0, 250.0]))
        room = 22.0 + 0.8 * np.sin(k / 40.0 + seed)
        errors = ["", ""]
        if k % 3 == 0:
            errors = [f"{factor * (x - 22) + 0.3 * rng.standard_normal():.3f}" for factor in (-5.0, 2.0)]
        lines.append(f"{300 * k},{room:.3f},{power:.0f},{','.join(errors)}")
        steady = room + 0.4 * power / 12.0
        x = steady + (x - steady) * float(np.exp(-300 * 12.0 / 60e3))
    path.write_text("\n".join(lines) + "\n")


def write_small(folder: Path) -> None:
    """campaign.toml, its recordings a, b and c, model.toml and experiment.toml."""
    for seed, name in enumerate("abc"):
        write_recording(folder / f"{name}.csv", seed)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    (folder / "model.toml").write_text(MODEL)
    (folder / "experiment.toml").write_text(EXPERIMENT)


def results_of(out: Path) -> dict[str, Any]:
    """What a run has written into `out`."""
    content: dict[str, Any] = json.loads((out / "results.json").read_text())
    return content
