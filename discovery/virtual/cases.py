"""Concealed cases for `discovery challenge`: a random machine, three recordings, something missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from discovery.virtual.casefiles import case_files
from discovery.virtual.concealing import MAKERS
from discovery.virtual.cycles import HOUR, noise
from discovery.virtual.faults import FAULTS
from discovery.virtual.fine import ERRORS, STEP_S, Array
from discovery.virtual.measurement import Columns
from discovery.virtual.world import FIT, RECORDINGS, World, draw_world, lumping

KINDS = {"none": 0.25, "one": 0.40, "two": 0.10, "measuring": 0.10, "outside": 0.15}
SLOW_UM, SLOW_TAU_S = 0.15, 2 * HOUR  # slow sensor noise of a coloured case


@dataclass(frozen=True)
class Case:
    """Files of a case folder (name: bytes), its key, the noise-free readings (R, 4) held out."""

    files: dict[str, bytes]
    key: dict[str, Any]
    truth: Array


def draw_kinds(count: int, seed: int) -> list[str]:
    """Kinds of `count` cases in random order, with the shares of KINDS as near as whole numbers allow."""
    exact = {kind: share * count for kind, share in KINDS.items()}
    numbers = {kind: int(value + 1e-9) for kind, value in exact.items()}
    for kind in sorted(exact, key=lambda k: numbers[k] - exact[k])[: count - sum(numbers.values())]:
        numbers[kind] += 1
    kinds = [kind for kind, number in numbers.items() for _ in range(number)]
    return [kinds[i] for i in np.random.default_rng([seed, 1]).permutation(count)]


def make_case(seed: int, kind: str, name: str | None = None) -> Case:
    """A concealed case of `kind` (one of KINDS). The same arguments give the same bytes."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), 20])
    coloured = bool(seed % 2) if kind == "none" else bool(rng.uniform() < 0.4)
    world = draw_world(rng, coloured=coloured)
    key: dict[str, Any] = {
        "effect": None,
        "states": [],
        "kind": kind,
        "noise": world.noise,
        "coloured": coloured,
    }
    base = world.readings()
    readings, found = base, dict[str, Any]()
    if kind in MAKERS:
        readings, found = MAKERS[kind](rng, world, base)
    truth = readings.reshape(len(RECORDINGS), -1, len(ERRORS))
    columns = [_record(rng, world, k, truth[k], coloured) for k in range(len(RECORDINGS))]
    if kind == "measuring":
        columns, found = _measuring(rng, world, columns)
    key |= found | {"lumping_over_noise": round(lumping(world), 3)} | _held_out(world, readings - base)
    files = case_files(
        name or f"concealed case {seed}",
        world.plant.machine,
        dict(zip(RECORDINGS, columns, strict=True)),
        rng,
    )
    return Case(files, key, truth[-1])


def _held_out(world: World, change: Array) -> dict[str, Any]:
    """Rms by output, in the held-out recording, of what is concealed and of what a refit leaves of it."""

    def rms(x: Array) -> dict[str, float]:
        each = np.sqrt(np.mean(x[world.seen :].reshape(-1, len(ERRORS)) ** 2, axis=0))
        return {name: round(float(value), 4) for name, value in zip(ERRORS, each, strict=True)}

    return {
        "held_out": {
            RECORDINGS[-1]: {"effect_rms": rms(change), "left_by_refit_rms": rms(world.left(change))}
        }
    }


def _record(rng: np.random.Generator, world: World, k: int, truth: Array, coloured: bool) -> Columns:
    """Columns of one recording: inputs each minute, held ones as means, readings every ten minutes."""
    u, per = world.inputs[k], round(60.0 / STEP_S)
    rows = len(u.air) // per

    def mean(x: Array) -> Array:
        return np.asarray(x.reshape(rows, per).mean(axis=1))

    def sensed(x: Array) -> Array:
        return np.asarray(x[::per] + rng.normal(0.0, 0.05, rows))

    columns: Columns = {
        "time": np.arange(rows, dtype=np.float64) * 60.0,
        "T_env": sensed(u.air),
        "T_fluid": sensed(u.fluid),
        "pump": mean(u.pump),
        "speed": mean(u.speed),
        "P_drive": mean(u.drive),
        "P_cool": mean(u.cooling),
    }
    at = np.arange(0, rows, 10)
    for j, name in enumerate(ERRORS):
        slow = noise(rng, len(at), 600.0, SLOW_TAU_S, SLOW_UM if coloured else 0.0)
        columns[name] = np.full(rows, np.nan)
        columns[name][at] = truth[: len(at), j] + slow + rng.normal(0.0, world.noise, len(at))
    return columns


def _measuring(
    rng: np.random.Generator, world: World, columns: list[Columns]
) -> tuple[list[Columns], dict[str, Any]]:
    """A fault of the measuring chain in one recording to fit, well above noise."""
    name = str(rng.choice(["sensor_offset", "sensor_drift", "outlier", "rezero", "clock_shift"]))
    output, where = str(rng.choice(ERRORS)), int(rng.integers(len(FIT)))
    low, high = {"sensor_drift": (1.5, 4.0), "outlier": (15.0, 60.0)}.get(name, (3.0, 9.0))
    size = float(rng.choice([-1.0, 1.0]) * world.noise * rng.uniform(low, high))
    size = 60.0 * int(rng.integers(10, 40)) if name == "clock_shift" else float(f"{size:.5g}")
    whole = name in ("sensor_drift", "clock_shift")  # acts all the time
    at = 0.0 if whole else round(float(rng.uniform(0.15, 0.85) * columns[0]["time"][-1]))
    faulty = [FAULTS[name][0](c, output, size, at) if k == where else c for k, c in enumerate(columns)]
    key: dict[str, Any] = {
        "effect": name,
        "recording": RECORDINGS[where],
        "size": size,
        "unit": FAULTS[name][2],
    }
    one_channel = {} if name in ("clock_shift", "rezero") else {"output": output}
    return faulty, key | one_channel | {"at_s": None if whole else at}
