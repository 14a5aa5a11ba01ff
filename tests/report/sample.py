"""A small run folder as `discovery run` leaves it: three errors, two recordings, four models."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.evaluation import evaluate

Array = NDArray[np.float64]

OUTPUTS = {"E_Y0C": ("um", -33.0, 0.5), "E_R0T": ("um", 12.0, 0.5), "E_A0C": ("um/m", 16.0, 1.5)}
MODELS = {
    "discovered": ("sindy", 0.02),
    "thermobalance": ("file", 0.07),
    "reduced": ("reduced", 0.12),
    "superposition": ("superposition", 0.2),
}

THERMOBALANCE = """
name = "thermobalance, three bodies"
[parameters]
G_tc = { start = 24.3, unit = "W/K", min = 0.0, low = 22.1, high = 26.5 }
hA_table = { start = 4.1, unit = "W/K", min = 0.0, low = 3.2, high = 5.0 }
hF = { start = 210.0, unit = "W/K", min = 0.0, low = 180.0, high = 240.0 }
loss = { start = 0.42, unit = "1", min = 0.0, max = 1.0, low = 0.4, high = 0.44 }
m = { start = 0.67, unit = "1", low = -0.1, high = 1.4 }
T_ref = { start = 22.0, unit = "degC", fixed = true }
[states]
table = { unit = "degC", capacity = 45000.0, start = "T_env" }
c_body_1 = { unit = "degC", capacity = 62000.0, start = "T_env" }
b_corpus = { unit = "degC", capacity = 405000.0, start = "T_env" }
[[terms]]
name = "conduction to table"
into = "table"
from = "c_body_1"
expression = "G_tc*(c_body_1 - table)"
[[terms]]
name = "flooded gap"
into = "c_body_1"
from = "b_corpus"
expression = "0.5*G_tc*pump*(b_corpus - c_body_1)"
effect = "flooded_gap"
[[terms]]
name = "air"
into = "table"
expression = "hA_table*(T_env - table)"
[[terms]]
name = "cutting fluid"
into = "table"
expression = "pump*where(speed > 1, hF*(speed/600)**m, 60)*(T_fluid - table)"
[[terms]]
name = "drive loss"
into = "c_body_1"
expression = "loss*P_drive"
[[terms]]
name = "air at the corpus"
into = "b_corpus"
expression = "6.5*(lag(T_env, 3600) - b_corpus)"
[outputs]
E_Y0C = "-1.7*(c_body_1 - T_ref) - 5.2*(b_corpus - T_ref)"
E_R0T = "1.92*(table - T_ref)"
"""

DISCOVERED = """
name = "discovered"
time_unit = "h"
[parameters]
a1 = { start = -0.31, unit = "1/h", low = -0.34, high = -0.28 }
b1 = { start = -1.32, unit = "um/h/K", low = -1.5, high = -1.1 }
b2 = { start = -0.0042, unit = "um/h/W", low = -0.0045, high = -0.0039 }
[states]
E_Y0C = { unit = "um", start = 0.0 }
[[terms]]
name = "decay of E_Y0C"
into = "E_Y0C"
expression = "a1*E_Y0C"
[[terms]]
name = "fluid into E_Y0C"
into = "E_Y0C"
expression = "b1*pump*(T_fluid - 22)"
[[terms]]
name = "drive into E_Y0C"
into = "E_Y0C"
expression = "b2*P_drive"
"""


def load(hours: Array, seed: int) -> Array:
    """A slow, bounded pattern of load between 0 and 1."""
    phase = np.random.default_rng(seed).uniform(0, 6, 4)
    periods = np.array([37.0, 23.0, 11.0, 7.0])
    waves: Array = np.sin(2 * np.pi * hours[:, None] / periods + phase).sum(axis=1)
    pattern: Array = (0.5 + 0.5 * np.tanh(waves)) * (1 - np.exp(-hours / 5))
    return pattern


def write_sample(folder: Path, hours: float = 24.0, diagnosis: bool = True) -> Path:
    """Write the run folder and return it."""
    rng = np.random.default_rng(5)
    (folder / "predictions").mkdir(parents=True)
    (folder / "models").mkdir()
    scores: dict[str, dict[str, Any]] = {name: {} for name in MODELS}
    for seed, recording in enumerate(("fit", "validation")):
        time = np.arange(0.0, hours * 3600 + 1, 600.0)
        columns: dict[str, Array] = {"time": time}
        for k, (output, (_, size, noise)) in enumerate(OUTPUTS.items()):
            truth = size * load(time / 3600, 10 * seed + k)
            reading = truth - truth[0] + noise * rng.standard_normal(len(time))
            reading[rng.random(len(time)) < 0.03] = np.nan
            columns[output] = reading
            for name, (_, wrong) in MODELS.items():
                model = truth - truth[0] + wrong * size * (load(time / 3600, 77 + k) - 0.5)
                columns[f"{output}|{name}"] = model
                scores[name].setdefault(recording, {})[output] = evaluate(reading, model)
        rows = [
            ",".join(columns),
            *(
                ",".join("" if np.isnan(v) else f"{v:.5g}" for v in row)
                for row in np.column_stack(list(columns.values()))
            ),
        ]
        (folder / "predictions" / f"{recording}.csv").write_text("\n".join(rows) + "\n")
    (folder / "models" / "thermobalance.toml").write_text(THERMOBALANCE)
    (folder / "models" / "discovered.toml").write_text(DISCOVERED)
    (folder / "results.json").write_text(json.dumps(results(scores)))
    if diagnosis:
        (folder / "diagnosis.json").write_text(json.dumps(diagnosed(hours)))
    return folder


def results(scores: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The content of results.json."""
    models: dict[str, Any] = {
        name: {
            "kind": kind,
            "terms": 5,
            "parameters": 20,
            "seconds": 0.8,
            "equations": [],
            "recordings": scores[name],
            "notes": [],
        }
        for name, (kind, _) in MODELS.items()
    }
    models["thermobalance"]["shares"] = {"drive loss": 0.55, "cutting fluid": 0.3, "air": 0.1}
    models["thermobalance"]["notes"] = ["not determined (95 % interval wider than the value): m"]
    models["discovered"]["search"] = {
        "path": [
            {
                "outputs": list(OUTPUTS),
                "terms": n,
                "left_out_rms": 6 / n + 0.9,
                "fit_rms": 5 / n,
                "chosen": n == 6,
            }
            for n in range(1, 12)
        ],
        "stability": {"drive into E_Y0C": 1.0, "fluid into E_Y0C": 0.93, "T_env into E_A0C": 0.41},
    }
    return {
        "experiment": "cutting <fluid>",
        "campaign": "a sample",
        "fit": ["fit"],
        "held_out": ["validation"],
        "outputs": list(OUTPUTS),
        "units": {name: unit for name, (unit, _, _) in OUTPUTS.items()},
        "noise": {name: noise for name, (_, _, noise) in OUTPUTS.items()},
        "input_units": {"speed": "rpm"},
        "parts": {"test cycle": "fit", "2. test cycle": "validation"},
        "models": models,
        "seconds": 21.5,
        "versions": {"python": "3.11.9", "discovery": "0.1.0"},
        "inputs": {"campaign.toml": "0" * 64},
    }


def diagnosed(hours: float) -> dict[str, Any]:
    """The content of diagnosis.json."""
    time = np.arange(0.0, hours * 3600, 1800.0)
    heat = 60 * load(time / 3600, 3)
    return {
        "model": "thermobalance",
        "verdict": "missing physics",
        "detection": {
            "p_value": 0.0004,
            "noise": {"E_Y0C": 0.5, "E_R0T": 0.5},
            "residual_rms": {"E_Y0C": 1.9, "E_R0T": 0.6},
        },
        "location": {
            "outputs": {"E_Y0C": 0.81, "E_R0T": 0.19},
            "states": {"b_corpus": 0.97, "c_body_1": 0.03},
            "unmodelled_heat_W": {"b_corpus": 38.0, "c_body_1": 4.1, "table": 0.9},
            "windows": [
                {
                    "recording": "fit",
                    "start_s": 7200 * 2,
                    "end_s": 7200 * 5,
                    "state": "b_corpus",
                    "heat_W": 81.0,
                }
            ],
            "regime": "pump > 0.5 and speed > 750",
        },
        "physics": [
            {
                "effect": "flooded_gap",
                "states": ["c_body_1", "b_corpus"],
                "probability": 0.98,
                "expression": "G_gap*pump*(b_corpus - c_body_1)",
                "parameters": {"G_gap": {"value": 38.3, "low": 35.1, "high": 41.6, "unit": "W/K"}},
            }
        ],
        "alternatives": [
            {"effect": "conduction_path", "states": ["table", "b_corpus"], "log_evidence_below_best": 2.1}
        ],
        "improvement": {
            "fit": {
                "rms_before": 0.61,
                "rms_after": 0.5,
                "outputs": {"E_Y0C": (0.8, 0.5), "E_R0T": (0.3, 0.5)},
            },
            "held_out": {"validation": {"rms_before": 0.6, "rms_after": 0.5}},
            "explained": 0.99,
        },
        "next_experiment": "Run the pump for six hours at 900 rpm, then stop it: the two rivals part there.",
        "missing_heat": {
            "state": "b_corpus",
            "over_time": {
                "fit": {"time_s": time.tolist(), "heat": heat.tolist(), "sd": (0 * heat + 5).tolist()}
            },
            "against": {"speed": {"value": [0, 300, 900], "heat": [0.5, 21, 59], "error": [2, 2, 3]}},
            "named": True,
        },
        "reasons": ["flooded gap adds 300 of log evidence"],
    }


def data_of(page: str) -> dict[str, Any]:
    """The data that a page draws its charts from."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data
