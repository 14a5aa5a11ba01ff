"""Thirty days of a compensated machine with everything that an ordinary month brings, on a simulated clock.

    python benchmarks/month.py [days] [seed] [--learn [--alone] [--known]]

A hall door, a chiller step, 5 h without a sensor, a clock set by a day, a frozen server, 20 kills, a full
disk and two power cuts; with --learn the machine ages as well (its losses fall by 1 % a day) and the
compensation follows it; --alone runs it once more without learning, --known with the wear given to the model
at every instant: what no learning can beat. The session, its memory, guards, clock,
output and history are those of `discovery compensate --opcua`; simulated are the machine, the two clocks of
the computer, and what the disk and the power do.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported, from_document, read_document, render
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal, private_key
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime import persistence
from discovery.runtime.clock import Clock
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.history import History, read_history
from discovery.runtime.learning import Learner
from discovery.runtime.opcua import _tell_jump
from discovery.runtime.output import Output
from discovery.runtime.session import Session, header
from discovery.runtime.shadow import Rule
from discovery.virtual.log import observe
from discovery.virtual.machine import Machine
from discovery.virtual.network import Inputs
from discovery.virtual.network import times as product
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import Order, ran

Array = NDArray[np.float64]
DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
TICK, HOUR, DAY = 60.0, 3600.0, 86_400.0
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
LEVER = np.array([1.0, 1.0, 1.0, 0.35])  # E_A0C weighs as um at 0.35 m
EPOCH = 1.8e9  # the wall clock when the month begins


@dataclass(frozen=True)
class Fault:
    """Something that happens from `start` to `end` [s]."""

    kind: str
    start: float
    end: float


@dataclass
class Plan:
    """What happens in a month (or in `scale` of it)."""

    faults: list[Fault]
    kills: list[float]
    hours: float

    def at(self, kind: str, now: float) -> bool:
        """Whether a fault of this kind is on."""
        return any(f.kind == kind and f.start <= now < f.end for f in self.faults)

    def quiet(self, times: Array) -> NDArray[np.bool_]:
        """Instants outside of all faults and 30 min after each, and after the first day."""
        good = times >= min(DAY, 0.25 * self.hours * HOUR)
        for f in self.faults:
            good &= (times < f.start) | (times >= f.end + 1800.0)
        for kill in self.kills:
            good &= (times < kill) | (times >= kill + 1800.0)
        return good


def month(days: int, seed: int) -> Plan:
    """What happens in thirty days; in fewer days, in proportion."""
    scale = days / 30.0

    def fault(kind: str, day: float, hours: float) -> Fault:
        return Fault(kind, scale * day * DAY, scale * day * DAY + hours * HOUR)

    rng = np.random.default_rng([seed, 17])
    faults = [
        fault("door", 3.3, 3.0),
        fault("chiller", 6.4, 12.0 * scale),
        fault("sensor", 9.2, 5.0),
        fault("clock", 12.1, 24.0 * scale),
        fault("frozen", 15.3, 2.0),
        fault("disk", 20.2, 3.0),
        fault("power", 24.1, 6.0 * max(scale, 0.3)),
        fault("power", 27.3, 2.0),
    ]
    kills = np.sort(rng.uniform(scale * DAY, days * DAY, max(2, round(20 * scale)))).tolist()
    kills = [k for k in kills if not any(f.kind == "power" and f.start <= k < f.end for f in faults)]
    return Plan(faults, kills, 24.0 * days)


@dataclass(frozen=True)
class World:
    """What really happens: inputs by name and errors, every minute, and what a probe would read."""

    times: Array
    inputs: dict[str, Array]
    errors: Array  # (K, 4), without noise
    probed: Array  # (K, 4), with the noise of a reading


def world(plan: Plan, seed: int, *, faults: bool, ageing: bool, lost: float = 0.0) -> World:
    """The virtual machine over the month. `faults`: door, chiller and power cuts, which are physics.
    `lost`: share of the losses that is gone from the beginning; `ageing`: 1 % more every day.
    """

    def happens(inputs: Inputs) -> Inputs:
        u, at = dict(inputs), inputs["clock"]
        for f in plan.faults if faults else ():
            on = (at >= f.start) & (at < f.end)
            if f.kind == "door":
                u["T_env"] = u["T_env"] + 2.5 * on
            elif f.kind == "chiller":
                u["T_set"] = u["T_set"] - 2.0 * on
            elif f.kind == "power":
                u |= {name: np.where(on, 0.0, u[name]) for name in ("speed", "flow", "pump")}
        return u

    order = Order("month", "fit", seed, plan.hours, machine=worn(lost, ageing), change=happens)
    machine, cycle, run = ran(order)
    columns = observe(
        machine, run, cycle.first, cycle.readings, np.random.default_rng([seed, 6]), order.chain
    )
    known = np.flatnonzero(np.isfinite(columns["T_env"]))
    times = columns["time"][known]
    inputs = {name: columns[name][known] for name in columns if name not in (*machine.outputs, "time")}
    index = [machine.outputs.index(name) for name in ERRORS]
    errors = machine.read(run)[cycle.first + np.round(times / run.step_s).astype(int)][:, index]
    noise = np.random.default_rng([seed, 7]).normal(0.0, order.chain.white, errors.shape)
    return World(times, inputs, errors, errors + noise)


def worn(lost: float, ageing: bool) -> Machine:
    """A machine whose bodies receive less of the losses: a share is gone, 1 % more a day with `ageing`."""
    fresh = five_axis()

    def gone(u: Inputs) -> Array:
        return np.asarray(-lost - 0.01 * ageing * np.maximum(u["clock"], 0.0) / DAY)

    losses = [law for law in fresh.network.laws if law.name.startswith("loss ")]
    return fresh.plus(
        [replace(law, name="wear", gate=product(law.gate, gone) if law.gate else gone) for law in losses]
    )


@dataclass
class Computer:
    """The two clocks of the computer that compensates, and its disk."""

    now: float = 0.0
    ahead: float = 0.0  # of the wall clock
    boot: int = 1
    full: bool = False

    def clock(self) -> Clock:
        return Clock(lambda: 1000.0 + self.now, lambda: EPOCH + self.now + self.ahead, f"boot {self.boot}")

    def refuse(self) -> None:
        if self.full:
            raise OSError(28, "No space left on device")


@contextmanager
def disk(computer: Computer) -> Iterator[None]:
    """Writing to the state, the output and the history fails while the disk is full."""
    written, opened = persistence._write, Output.flush
    flushed = History.flush

    def write(body: str, folder: Path) -> None:
        computer.refuse()
        written(body, folder)

    def flush(self: Output) -> OSError | None:
        if computer.full and self.pending:
            return OSError(28, "No space left on device")
        return opened(self)

    def history(self: Any, now: float, *, force: bool = False) -> Exception | None:
        if computer.full:
            return OSError(28, "No space left on device")
        return flushed(self, now, force=force)

    with (
        mock.patch.object(persistence, "_write", write),
        mock.patch.object(Output, "flush", flush),
        mock.patch.object(History, "flush", history),
    ):
        yield


@dataclass
class Result:
    """What a month left. `left` (K, 4): errors under compensation, NaN while it was off."""

    times: Array
    left: Array
    states: list[str]
    events: list[str]
    rows: list[float]  # stamps of the output
    revisions: int
    probes: int
    counted: Counter[str] = field(default_factory=Counter)


def live(
    exported: Exported,
    happening: World,
    plan: Plan,
    folder: Path,
    *,
    faults: bool,
    learn: Callable[[], Learner] | None = None,
    save_every_s: float = 5 * TICK,
) -> Result:
    """Run the compensation through the month, tick by tick."""
    computer, events, left, states = Computer(), list[str](), [], []
    model = folder / "model.json"
    if not model.exists():
        model.write_bytes(render(exported.document))
    kills = iter([*plan.kills, np.inf] if faults else [np.inf])
    next_kill, session, probes, last_probe = next(kills), None, 0, -np.inf
    teacher = learn() if learn is not None else None

    def hear(text: str) -> None:
        events.append(text)

    def start() -> Session:
        clock = computer.clock()
        found = Session(
            exported,
            model=model,
            folder=folder / "memory",
            settings=Settings(tick_s=TICK),
            rule=Rule(hours=12.0),
            save_every_s=save_every_s,
            clock=clock,
            learn=teacher,
            say=hear,
        )
        at = found.resume_at if found.resumed is not None else None
        found.opens = lambda: Output(folder / "offsets.csv", header(found.compensator), at, replay=False)
        return found

    with disk(computer):
        for k, now in enumerate(happening.times.tolist()):
            computer.now, computer.full = now, faults and plan.at("disk", now)
            if faults and plan.at("power", now):
                if session is not None:
                    _cut_power(session, folder, k)
                    session, computer.boot = None, computer.boot + 1
                left.append([np.nan] * 4)
                states.append("no power")
                continue
            if now >= next_kill and session is not None and not computer.full:
                _kill(session)
                session, next_kill = None, next(kills)
            computer.ahead = DAY if faults and plan.at("clock", now) else 0.0
            if session is None:
                session = start()
            assert session.clock is not None
            _tell_jump(session.clock, session)
            inside = session.clock.now()
            source = k
            if faults and plan.at("frozen", now):
                frozen = next(f for f in plan.faults if f.kind == "frozen")
                source = int(np.searchsorted(happening.times, frozen.start))
            age = now - float(happening.times[source])
            readings = {
                n: Reading(float(series[source]), inside - age) for n, series in happening.inputs.items()
            }
            if faults and plan.at("sensor", now):
                readings["T_fluid"] = Reading(None, inside, False)
            every = 0.5 * HOUR if teacher is not None and teacher.advice else 2 * HOUR
            if learn is not None and now - last_probe >= every and session.compensator.predicted is not None:
                last_probe, probes = now, probes + 1
                for name, value in zip(ERRORS, happening.probed[k].tolist(), strict=True):
                    offset = session.compensator.offsets[session.compensator.names.index(name)]
                    readings[name] = Reading(value + offset, inside)
                    readings[f"{name}_applied"] = Reading(-offset, inside)
            tick = session.tick(readings, inside)
            left.append([happening.errors[k, j] + tick.offsets[n] for j, n in enumerate(ERRORS)])
            states.append(tick.state.name)
        assert session is not None
        session.close(session.clock.now() if session.clock is not None else computer.now)
    lines = (folder / "offsets.csv").read_text().splitlines()[1:]
    active = read_document(folder / "memory" / "active.json")
    return Result(
        happening.times,
        np.array(left),
        states,
        events,
        [float(line.split(",")[0]) for line in lines],
        active.revision,
        probes,
        Counter(read_history(folder / "memory")["counts"]),
    )


def happening_noise(seed: int, shape: tuple[int, ...]) -> Array:
    """The noise of a probe, for errors as an operator reads them."""
    return np.random.default_rng([seed, 8]).normal(0.0, Order("month").chain.white, shape)


def _kill(session: Session) -> None:
    """As kill -9 does: nothing is written any more, the lock is gone."""
    for one in (session.output.file if session.output else None, session.lock):
        if one is not None:
            one.close()
    if session.history is not None and session.history.base is not None:
        session.history.base.close()


def _cut_power(session: Session, folder: Path, k: int) -> None:
    """The newest state was on its way to the disk: torn; a line of the output too."""
    _kill(session)
    path = folder / "memory" / persistence.NAMES[0]
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2 + k % 7])
    with (folder / "offsets.csv").open("ab") as file:
        file.write(b"1800000123.4,ACT")


def rms(left: Array) -> float:
    """rms of errors (K, 4) in um."""
    return float(np.sqrt(np.nanmean((left * LEVER) ** 2)))


def machine() -> Exported:
    """The fitted thermobalance."""
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model
    return from_document(*open_seal(render(make_document(model, campaign, ["fit"])), "model"), "model")


def compare(
    days: int,
    seed: int,
    folder: Path,
    *,
    learning: bool,
    alone: bool = False,
    known: bool = False,
    exported: Exported | None = None,
) -> dict[str, Any]:
    """The month with and without its faults: figures by name."""
    exported = exported or machine()
    plan = month(days, seed)
    key = private_key(folder / "key.pem")
    learn = (lambda: Learner(key)) if learning else None
    calm = replace(plan, hours=min(plan.hours, 72.0)) if learning else plan
    clean_world = world(calm, seed, faults=False, ageing=False)
    true_world = world(plan, seed, faults=True, ageing=learning)
    (folder / "clean").mkdir()
    (folder / "true").mkdir()
    clean = live(exported, clean_world, plan, folder / "clean", faults=False, save_every_s=HOUR)
    found = live(exported, true_world, plan, folder / "true", faults=True, learn=learn)
    quiet = plan.quiet(found.times)
    first = (clean.times >= min(DAY, 0.25 * plan.hours * HOUR)) & (
        clean.times < min(2 * DAY, 0.5 * plan.hours * HOUR)
    )
    on = np.array([state != "no power" for state in found.states])
    last = found.times >= found.times[-1] - min(7 * DAY, 0.25 * plan.hours * HOUR)
    gaps = np.diff(found.rows)
    read = happening_noise(seed, found.left.shape)
    figures = {
        "clean, day two, by readings with their noise, um": rms(
            (clean.left + read[: len(clean.left)])[first]
        ),
        "with faults, last week, by readings, um": rms((found.left + read)[quiet & last]),
        "state at the end": found.states[-1],
        "clean, the same instants, um": None if learning else rms(clean.left[quiet]),
        "clean, day two, um": rms(clean.left[first]),
        "with faults, outside of them, um": rms(found.left[quiet]),
        "all of the month, um": rms(found.left),
        "uncompensated, um": rms(true_world.errors),
        "last week, outside of faults, um": rms(found.left[quiet & last]),
        "ticks": int(on.sum()),
        "rows": len(found.rows),
        "rows out of order or twice": int(np.sum(gaps <= 0.0)),
        "events": dict(found.counted),
        "revision": found.revisions,
        "probes": found.probes,
        "states": dict(Counter(found.states)),
    }
    if alone:
        (folder / "left").mkdir()
        left_alone = live(exported, true_world, plan, folder / "left", faults=True)
        figures["without learning, last week, um"] = rms(left_alone.left[quiet & last])
        figures["without learning, by readings, um"] = rms((left_alone.left + read)[quiet & last])
    if known:
        (folder / "known").mkdir()
        left = 1.0 - 0.01 * true_world.times / DAY  # the losses are shares of this power
        worn_inputs = {**true_world.inputs, "P_drive": true_world.inputs["P_drive"] * left}
        seen = replace(true_world, inputs=worn_inputs)
        best = live(exported, seen, plan, folder / "known", faults=True, learn=learn)
        figures["with known wear, last week, um"] = rms(best.left[quiet & last])
        figures["with known wear, by readings, um"] = rms((best.left + read)[quiet & last])
    figures["said"] = found.events
    return figures


def main(words: list[str]) -> None:
    """Print the figures of a month."""
    began = time.perf_counter()
    numbers = [int(word) for word in words if word.isdigit()]
    days, seed = itertools.chain(numbers, (30, 4000)[len(numbers) :])
    fast = "/dev/shm" if Path("/dev/shm").is_dir() else None  # 40 000 flushes to a real disk take 20 min
    with tempfile.TemporaryDirectory(dir=fast) as name:
        found = compare(
            days, seed, Path(name),
            learning="--learn" in words, alone="--alone" in words, known="--known" in words,
        )  # fmt: skip
    for text in found.pop("said"):
        print(f"  {text}"[:260])
    for title, value in found.items():
        print(f"{title}: {value:.3f}" if isinstance(value, float) else f"{title}: {value}")
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
