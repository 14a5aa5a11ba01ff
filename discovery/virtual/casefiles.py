"""Files of a concealed case: recordings, campaign, the baseline that somebody believes in, experiment."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from discovery.virtual.fine import BODIES, COOLED, ERRORS, LINKS, LOSSES, T_REF, WET, Array, FineMachine
from discovery.virtual.record import csv_gz

ROLES = {
    "T_env": ("ambient temperature", "degC", 3),
    "T_fluid": ("fluid temperature", "degC", 3),
    "pump": ("fluid flow", "1", 3),
    "speed": ("rotation speed", "rpm", 1),
    "P_drive": ("heat load", "W", 1),
    "P_cool": ("cooling power", "W", 2),
    "E_Y0C": ("error", "um", 2),
    "E_Z0T": ("error", "um", 2),
    "E_R0T": ("error", "um", 2),
    "E_A0C": ("error", "um/m", 2),
}
SHORT = {"table": "table", "c_body_1": "c1", "c_body_2": "c2", "b_corpus": "b", "side": "side"}


def case_files(
    title: str, m: FineMachine, recordings: Mapping[str, Mapping[str, Array]], rng: np.random.Generator
) -> dict[str, bytes]:
    """All files of a case folder by name; `rng` roughens the start values of the baseline."""
    decimals = {"time": 0} | {name: digits for name, (_, _, digits) in ROLES.items()}
    files = {f"{name}.csv.gz": csv_gz(dict(columns), decimals) for name, columns in recordings.items()}
    texts = {
        "campaign.toml": _campaign(title, list(recordings)),
        "baseline.toml": _baseline(m, rng),
        "experiment.toml": _experiment(title, list(recordings)),
    }
    return files | {name: text.encode() for name, text in texts.items()}


def _campaign(title: str, names: list[str]) -> str:
    lines = [f"name = {json.dumps(title)}", "", "[channels]"]
    lines += [f'{c:7s} = {{ role = "{role}", unit = "{unit}" }}' for c, (role, unit, _) in ROLES.items()]
    lines += ["", "[recordings]", *(f'{n} = {{ file = "{n}.csv.gz" }}' for n in names)]
    return "\n".join(lines) + "\n"


def _experiment(title: str, names: list[str]) -> str:
    return f"""name = {json.dumps(title)}
campaign = "campaign.toml"
fit = {json.dumps(names[:-1])}
held_out = {json.dumps(names[-1:])}

[models]
baseline = {{ file = "baseline.toml" }}

[mismatch]
model = "baseline"
"""


def _baseline(m: FineMachine, rng: np.random.Generator) -> str:
    """The lumped machine: exact in structure, capacities and levers, rough in everything that is fitted."""
    parameters: list[str] = []
    terms: list[str] = []

    def parameter(name: str, value: float, unit: str) -> None:
        start = value * np.exp(rng.normal(0.0, 0.3))
        parameters.append(f'{name} = {{ start = {start:.2g}, unit = "{unit}", min = 0.0 }}')

    def term(name: str, into: str, expression: str, source: str = "") -> None:
        origin = f'from = "{source}"\n' if source else ""
        terms.append(f'[[terms]]\nname = "{name}"\ninto = "{into}"\n{origin}expression = "{expression}"\n')

    for (i, j), G in zip(LINKS, m.links, strict=True):
        a, b = BODIES[i], BODIES[j]
        name = f"G_{SHORT[a]}_{SHORT[b]}"
        parameter(name, G, "W/K")
        term(f"conduction {b} to {a}", a, f"{name}*({b} - {a})", b)
    for body, G in zip(BODIES, m.air, strict=True):
        parameter(f"hA_{body}", G, "W/K")
        term(f"air around {body}", body, f"hA_{body}*(T_env - {body})")
    for i, share in zip(LOSSES, m.loss, strict=True):
        parameter(f"loss_{BODIES[i]}", share, "1")
        term(f"drive loss into {BODIES[i]}", BODIES[i], f"loss_{BODIES[i]}*P_drive")
    parameter("k_cool", m.cooling, "1")
    term("internal cooling", BODIES[COOLED], "-k_cool*P_cool")
    for i, G in zip(WET, m.wet, strict=True):
        parameter(f"hF_{BODIES[i]}", G, "W/K")
        term(f"cutting fluid on {BODIES[i]}", BODIES[i], f"hF_{BODIES[i]}*pump*(T_fluid - {BODIES[i]})")
    states = [
        f'{body} = {{ unit = "degC", capacity = {C:.0f}, start = "T_env" }}'
        for body, C in zip(BODIES, m.capacity, strict=True)
    ]
    outputs = []
    for error, row in zip(ERRORS, m.outputs, strict=True):
        parts = [f"{k:+.5f}*({body} - {T_REF:g})" for body, k in zip(BODIES, row, strict=True) if k]
        outputs.append(f'{error} = "{" ".join(parts)}"')
    head = [
        'name = "thermobalance, five bodies"',
        "",
        "[parameters]",
        *parameters,
        "",
        "[states]",
        *states,
        "",
    ]
    return "\n".join([*head, *terms, "[outputs]", *outputs, ""])
