"""Recordings of the paper's virtual machine, from an order to files: always the same bytes."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from discovery.errors import UsageError
from discovery.files import format_toml, write_atomic
from discovery.virtual import faults
from discovery.virtual.effects import EFFECTS, Shapes
from discovery.virtual.log import Chain, Columns, csv_gz, decimals, observe
from discovery.virtual.machine import Machine
from discovery.virtual.network import Inputs, heat
from discovery.virtual.nmv5000.cycles import KINDS, STEP_S, Cycle, make_cycle
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.signals import HOUR, Draw, noise
from discovery.virtual.simulate import Run, State, simulate

MOST = 3.0  # times the reach of an effect: what the plant still computes


@dataclass(frozen=True)
class Request:
    """An effect asked for: its name, its size, the bodies (or the output) where it acts."""

    effect: str
    size: float
    states: tuple[str, ...]


@dataclass(frozen=True)
class Order:
    """One recording asked for; everything random in it comes from `seed` and `cycle`."""

    name: str
    cycle: str = "fit"
    seed: int = 1
    hours: float = 72.0
    nozzle_height_mm: float = 50.0
    nozzle_side: float = 0.0  # 0 centre, 1 left
    effects: tuple[Request, ...] = ()
    faults: tuple[tuple[str, str, float], ...] = ()  # name, channel, size
    age: float = 0.0  # how many recordings came before, for `wear`
    note: str = ""
    machine: Machine = field(default_factory=five_axis)
    change: Callable[[Inputs], Inputs] | None = None  # what else happens to the inputs of the cycle
    chain: Chain = field(default_factory=lambda: Chain(white=0.4, slow=0.3))


@dataclass(frozen=True)
class Taken:
    """A recording, and what only its maker knows."""

    columns: Columns
    fault_at_s: tuple[float, ...]


def ran(order: Order) -> tuple[Machine, Cycle, Run]:
    """The machine of an order with what is concealed in it, its cycle, and what it did."""
    cycle = make_cycle(order.cycle, order.seed, order.hours, order.nozzle_height_mm, order.nozzle_side)
    if order.change:
        cycle = replace(cycle, inputs=order.change(cycle.inputs))
    n = len(cycle.inputs["T_env"])
    initial, unrecorded, *_ = _streams(order)
    machine = concealing(order.machine, order.effects)
    own = {b: noise(unrecorded, n, STEP_S, 3 * HOUR, machine.pace.heat_w) for b in machine.bodies}
    machine = machine.plus(
        [
            heat("unrecorded", node, share, f"unrecorded {b}")
            for b, bar in machine.bodies.items()
            for node, share in bar.span()
        ]
    )
    inputs = {**cycle.inputs, **{f"unrecorded {b}": x for b, x in own.items()}}
    inputs |= {"number": np.full(n, 0.0), "age": np.full(n, order.age)}
    room = float(cycle.inputs["T_env"][0]) + initial.normal(0.0, 0.1)
    start = State(dict.fromkeys(("sump", "hose"), cycle.fluid_start), {}, room)
    return machine, cycle, simulate(machine.network, inputs, STEP_S, start)


def take(order: Order) -> Taken:
    """Run the machine once and record it."""
    machine, cycle, run = ran(order)
    *_, reading, fault = _streams(order)
    columns = observe(machine, run, cycle.first, cycle.readings, reading, order.chain)
    instants = []
    for name, channel, size in order.faults:
        instants.append(float(np.round(fault.uniform(0.2, 0.8) * order.hours * HOUR)))
        columns = FAULTS[name][0](columns, channel, size, instants[-1])
    return Taken(columns, tuple(instants))


def _streams(order: Order) -> list[Draw]:
    """Separate streams for start, small heat, readings and faults: an effect changes nothing but itself."""
    return np.random.default_rng([order.seed, list(KINDS).index(order.cycle), 1]).spawn(4)


def concealing(machine: Machine, requests: Sequence[Request]) -> Machine:
    """A machine with effects in it, in their textbook shapes."""
    for request in requests:
        machine = EFFECTS[request.effect].conceal(machine, request.states, request.size, Shapes())
    return machine


def parse_request(text: str) -> Request:
    """Read `name[@body[+body]]=size`.

    Raises:
        UsageError: an unknown name or place, a size that is no number or far from any machine.
    """
    machine = five_axis()
    known = {word: e for word, e in EFFECTS.items() if e.places(machine)}
    head, equals, size_text = text.partition("=")
    name, at, where = head.strip().partition("@")
    if name not in known:
        raise UsageError(f"There is no effect '{name}' in '{text}'; choose one of: {', '.join(known)}.")
    effect, places = known[name], known[name].places(machine)
    size, unit = _number(size_text), effect.unit.removesuffix("1")
    place = tuple(where.split("+")) if at else places[0]
    if place not in places and place[::-1] not in places:
        choice = ", ".join("+".join(p) for p in places)
        raise UsageError(f"'{name}' cannot act at '{where}' in '{text}'; choose one of: {choice}.")
    usual = effect.reach(machine, place)
    if not equals or not np.isfinite(size):
        raise UsageError(
            f"The effect '{text}' needs a size, for example {name}={0.2 * usual:.3g} ({unit or 'a number'})."
        )
    if not 0.0 <= size <= MOST * usual:
        raise UsageError(
            f"The size in '{text}' is not possible; give 0 to {MOST * usual:.3g} {unit}".rstrip() + "."
        )
    return Request(name, size, place if place in places else place[::-1])


def draw_effect(seed: int) -> Request:
    """An effect, its place and size drawn by seed, for a machine that hides something."""
    rng, machine = np.random.default_rng([seed, 4711]), five_axis()
    names = [word for word, e in EFFECTS.items() if e.places(machine)]
    effect = EFFECTS[str(rng.choice(names))]
    places = effect.places(machine)
    place = places[int(rng.integers(len(places)))]
    return Request(effect.word, float(f"{effect.reach(machine, place) * rng.uniform(0.1, 0.6):.3g}"), place)


def _rezero(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    del channel
    shares = dict(zip(five_axis().outputs, (0.2, 1.0, -1.0, 0.5, -2.0), strict=True))
    return faults.rezero(columns, {o: size * share for o, share in shares.items()}, at_s)


def _clock_shift(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    del channel, at_s
    return faults.clock_shift(columns, five_axis().outputs, size)


def _lag(columns: Columns, channel: str, size: float, at_s: float) -> Columns:
    del at_s
    return faults.sensor_lag(columns, channel, size)


FAULTS: dict[str, tuple[Any, str, str, float]] = {
    # name: function, default channel, unit of the size, example size
    "sensor_offset": (faults.sensor_offset, "E_Z0T", "um", 4.0),
    "sensor_drift": (faults.sensor_drift, "E_R0T", "um a day", 1.2),
    "sensor_lag": (_lag, "T_fluid", "s", 1200.0),
    "outlier": (faults.outlier, "E_A0C", "um", 60.0),
    "clock_shift": (_clock_shift, "", "s", 900.0),
    "rezero": (_rezero, "", "um", 5.0),
}


def parse_fault(text: str) -> tuple[str, str, float]:
    """Read `name[@channel]=size`.

    Raises:
        UsageError: an unknown name or channel, a size that is no number.
    """
    head, _, size_text = text.partition("=")
    name, _, channel = head.strip().partition("@")
    if name not in FAULTS:
        raise UsageError(f"There is no fault '{name}' in '{text}'; choose one of: {', '.join(FAULTS)}.")
    channels, channel = [c.name for c in five_axis().channels], channel or FAULTS[name][1]
    if channel and channel not in channels:
        raise UsageError(f"There is no channel '{channel}' in '{text}'; choose from: {', '.join(channels)}.")
    size = _number(size_text)
    if not np.isfinite(size):
        _, _, unit, example = FAULTS[name]
        raise UsageError(f"The fault '{text}' needs a size in {unit}, for example {name}={example:g}.")
    return name, channel, size


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def file_name(order: Order) -> str:
    """The file of a recording, in the folder of its campaign."""
    return f"{order.name}.csv.gz"


def recording_file(order: Order, taken: Taken) -> bytes:
    """The recording as gzip CSV."""
    return csv_gz(taken.columns, decimals(order.machine.channels))


def write_campaign(out: Path, title: str, orders: Sequence[Order]) -> list[dict[str, Any]]:
    """Record every order into `out`, its `campaign.toml` last. Returns the answers, one for each recording.

    Raises:
        UserError: `out` cannot be written.
    """
    answers = []
    for order in orders:
        taken = take(order)
        write_atomic(out / file_name(order), recording_file(order, taken))
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
        "faults": [
            {"effect": name, "channel": channel, "size": size, "at_s": at}
            for (name, channel, size), at in zip(order.faults, taken.fault_at_s, strict=True)
        ],
    }


def write_answers(path: Path, answers: Sequence[dict[str, Any]]) -> None:
    """Write the answers to `path`, in one JSON file."""
    write_atomic(path, json.dumps(list(answers), indent=2) + "\n")


def campaign_toml(title: str, orders: Sequence[Order]) -> str:
    """The campaign file."""
    white = orders[0].chain.white
    channels = {
        c.name: {"role": c.role, "unit": c.unit} | ({} if c.series else {"noise": white * c.sd})
        for c in orders[0].machine.channels
    }
    recordings = {o.name: {"file": file_name(o)} | ({"note": o.note} if o.note else {}) for o in orders}
    return format_toml({"name": title, "simulated": True, "channels": channels, "recordings": recordings})
