"""Recordings of the virtual machine: from a request to the files of a campaign, always the same bytes."""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from discovery.files import write_atomic
from discovery.virtual.cycles import HOUR, KINDS, Array, Cycle, make_cycle
from discovery.virtual.effects import EFFECTS, Request, sizes
from discovery.virtual.faults import FAULTS
from discovery.virtual.machine import BODIES, Machine
from discovery.virtual.measurement import CHANNELS, Chain, Columns, everyday_heat, observe
from discovery.virtual.plant import simulate


@dataclass(frozen=True)
class Order:
    """One recording asked for; everything random in it comes from `seed` and `cycle`."""

    name: str
    cycle: str = "fit"
    seed: int = 1
    hours: float = 72.0
    nozzle_height_mm: float = 50.0
    effects: tuple[Request, ...] = ()
    faults: tuple[tuple[str, str, float], ...] = ()  # name, channel, size
    age: float = 0.0  # how many recordings came before, for `wear`
    note: str = ""
    machine: Machine = field(default_factory=Machine)
    chain: Chain = field(default_factory=Chain)


@dataclass(frozen=True)
class Taken:
    """A recording, and what only its maker knows."""

    columns: Columns
    windows: tuple[tuple[str, float, float], ...]  # body, start [s], end [s] of hidden heat
    fault_at_s: tuple[float, ...]


def take(order: Order) -> Taken:
    """Run the machine once and record it."""
    cycle = make_cycle(order.cycle, order.seed, order.hours, order.nozzle_height_mm)
    n = len(cycle.speed)
    # Separate streams, so that an effect changes nothing but itself.
    rng = np.random.default_rng([order.seed, list(KINDS).index(order.cycle), 1])
    initial, everyday, reading, hidden, fault = rng.spawn(5)
    heat, windows = hidden_heat(hidden, cycle, order.effects)
    run = simulate(
        cycle,
        order.machine,
        sizes(order.effects),
        heat=heat + everyday_heat(everyday, n, cycle.step_s, order.chain),
        start=cycle.air[0] + initial.normal(0.0, 0.1, 5),
        age=order.age,
    )
    columns = observe(cycle, run, reading, order.chain)
    instants = []
    for name, channel, size in order.faults:
        instants.append(float(np.round(fault.uniform(0.2, 0.8) * order.hours * HOUR)))
        columns = FAULTS[name][0](columns, channel, size, instants[-1])
    return Taken(columns, windows, tuple(instants))


def hidden_heat(
    rng: np.random.Generator, cycle: Cycle, requests: Sequence[Request]
) -> tuple[Array, tuple[tuple[str, float, float], ...]]:
    """Heat (n, 5) [W] that no channel shows: a window of 3 to 10 h, swarf in pulses while the pump runs."""
    n = len(cycle.speed)
    heat, windows = np.zeros((n, 5)), []
    for request in requests:
        spans = []
        if request.effect == "unmeasured_heat":
            length = min(n // 2, round(rng.uniform(3, 10) * HOUR / cycle.step_s))
            start = int(rng.integers(0, n - length))
            spans = [(start, start + length)]
        elif request.effect == "swarf_heat":
            start = 0
            while start < n:
                start += round(rng.exponential(2 * HOUR) / cycle.step_s)
                end = start + round(rng.uniform(300, 2400) / cycle.step_s)
                spans.append((start, end))
                start = end
        for start, end in spans:
            for state in request.states:
                working = cycle.flow[start:end] > 0 if request.effect == "swarf_heat" else 1.0
                heat[start:end, BODIES.index(state)] += request.size * working
        if request.effect == "unmeasured_heat":
            windows += [
                (state, a * cycle.step_s, b * cycle.step_s) for a, b in spans for state in request.states
            ]
    return heat, tuple(windows)


def draw_effect(seed: int) -> Request:
    """An effect, its place and size drawn by seed, for a machine that hides something."""
    rng = np.random.default_rng([seed, 4711])
    name = str(rng.choice(list(EFFECTS)))
    effect = EFFECTS[name]
    size = float(f"{rng.uniform(effect.low, effect.high):.3g}")
    states = effect.at
    if name in ("fluid_convection", "air_convection", "second_thermal_mass", "unmeasured_heat", "radiation"):
        states = (str(rng.choice([b for b in BODIES if name != "fluid_convection" or b[0] == "b"])),)
    return Request(name, size, states)


def csv_gz(columns: Columns, decimals: Mapping[str, int]) -> bytes:
    """The recording as gzip CSV, without name and date in the header: the same bytes every time."""
    cells = [
        ["" if np.isnan(v) else f"{v:.{decimals.get(name, 2)}f}" for v in values]
        for name, values in columns.items()
    ]
    text = ",".join(columns) + "\n" + "\n".join(map(",".join, zip(*cells, strict=True))) + "\n"
    buffer = io.BytesIO()
    with gzip.GzipFile(filename="", mode="wb", fileobj=buffer, mtime=0, compresslevel=9) as file:
        file.write(text.encode())
    return buffer.getvalue()


DECIMALS = {"time": 0} | {name: decimals for name, (_, _, decimals) in CHANNELS.items()}


def file_name(order: Order) -> str:
    """The file of a recording, in the folder of its campaign."""
    return f"{order.name}.csv.gz"


def write_campaign(out: Path, title: str, orders: Sequence[Order]) -> list[dict[str, Any]]:
    """Record every order into `out`, its `campaign.toml` last. Returns the answers, one for each recording.

    Raises UserError when `out` cannot be written.
    """
    answers = []
    for order in orders:
        taken = take(order)
        write_atomic(out / file_name(order), csv_gz(taken.columns, DECIMALS))
        answers.append(answer(order, taken))
    write_atomic(out / "campaign.toml", campaign_toml(title, orders))
    return answers


def answer(order: Order, taken: Taken) -> dict[str, Any]:
    """What is concealed in one recording, for the envelope."""
    return {
        "recording": order.name,
        "effects": [
            {"effect": r.effect, "states": list(r.states), "size": r.size, "unit": EFFECTS[r.effect].unit}
            for r in order.effects
        ],
        "windows": [{"state": s, "start_s": a, "end_s": b} for s, a, b in taken.windows],
        "faults": [
            {"effect": name, "channel": channel, "size": size, "at_s": at}
            for (name, channel, size), at in zip(order.faults, taken.fault_at_s, strict=True)
        ],
    }


def write_answers(path: Path, answers: Sequence[dict[str, Any]]) -> None:
    """Write the answers to `path`, in one JSON file."""
    write_atomic(path, json.dumps(list(answers), indent=2) + "\n")


def campaign_toml(title: str, orders: Sequence[Order]) -> str:
    """The campaign file, laid out for a reader."""
    white = dict(zip([c for c in CHANNELS if c[:2] == "E_"], asdict(orders[0].chain)["white"], strict=True))
    lines = [f"name = {json.dumps(title)}", "", "[channels]"]
    for name, (role, unit, _) in CHANNELS.items():
        extra = f", noise = {white[name]:g}" if name in white else ""
        lines.append(f'{name:8s} = {{ role = "{role}", unit = "{unit}"{extra} }}')
    lines += ["", "[recordings]"]
    width = max(len(order.name) for order in orders)
    for order in orders:
        note = f", note = {json.dumps(order.note)}" if order.note else ""
        lines.append(f'{order.name:{width}s} = {{ file = "{file_name(order)}"{note} }}')
    return "\n".join(lines) + "\n"
