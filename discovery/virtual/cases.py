"""Concealed cases: a machine of a family with three recordings, something in them that its baseline lacks.

A case is a folder of files as a user would have them, and a key that says what is concealed. Its size is what
a refit of the baseline leaves of it, over the noise of a reading; below 1 `no mismatch` is right, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from discovery.virtual import faults
from discovery.virtual.casefiles import case_files
from discovery.virtual.effects import EFFECTS, OUTSIDE, Effect, Place, Shapes
from discovery.virtual.effects.structure import window
from discovery.virtual.families import FAMILIES
from discovery.virtual.log import Columns
from discovery.virtual.machine import Machine
from discovery.virtual.signals import Draw
from discovery.virtual.world import FIT, RECORDINGS, World, draw_world

KINDS = {"none": 0.23, "one": 0.40, "input": 0.10, "two": 0.09, "measuring": 0.10, "outside": 0.08}
FAULTS = ("sensor_offset", "sensor_drift", "sensor_gain", "sensor_lag", "outlier", "rezero", "clock_shift")
SIZES = (0.7, 5.0)  # rms that a refit leaves over noise, drawn evenly in its logarithm
OF_TWO = (1.5, 4.0)
VISIBLE = 1.0
ALONE = frozenset(
    {
        "radiation",
        "copper_resistance",
        "windage",
        "swarf_heat",
        "contact_conductance",
        "unmeasured_heat",
        "draught",
    }
)  # never one of two

Key = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """Files of a case folder (name: bytes) and its key."""

    files: dict[str, bytes]
    key: Key


@dataclass(frozen=True)
class Plan:
    """What a case is to conceal: its kind, and the effect or fault where the kind leaves a choice."""

    kind: str
    word: str = ""
    index: int = 0  # among OUTSIDE


def draw_plans(family: str, count: int, seed: int) -> list[Plan]:
    """Plans of `count` cases in random order, the shares of KINDS as near as whole numbers allow.

    Effects and faults are dealt like cards: each that the family can have comes before one returns.
    """
    rng = np.random.default_rng([seed, 1, *family.encode()])
    machine = FAMILIES[family](np.random.default_rng(0))
    possible = [e.word for e in EFFECTS.values() if e.places(machine)]
    decks = {
        "one": _deal(rng, [w for w in possible if not w.startswith("input_")]),
        "input": _deal(rng, [w for w in possible if w.startswith("input_")]),
        "measuring": _deal(rng, list(FAULTS)),
        "outside": _deal(rng, [str(k) for k, e in enumerate(OUTSIDE) if e.places(machine)]),
    }
    plans = [Plan(kind, word=next(decks[kind]) if kind in decks else "") for kind in _kinds(count)]
    return [plans[i] for i in rng.permutation(count)]


def _kinds(count: int) -> list[str]:
    exact = {kind: share * count for kind, share in KINDS.items()}
    numbers = {kind: int(value + 1e-9) for kind, value in exact.items()}
    for kind in sorted(exact, key=lambda k: numbers[k] - exact[k])[: count - sum(numbers.values())]:
        numbers[kind] += 1
    return [kind for kind, number in numbers.items() for _ in range(number)]


def _deal(rng: Draw, cards: list[str]) -> Iterator[str]:
    while True:
        yield from (cards[i] for i in rng.permutation(len(cards)))


def make_case(family: str, seed: int, plan: Plan, name: str = "") -> Case:
    """A concealed case. The same arguments give the same bytes."""
    rng = np.random.default_rng([seed, 20, *family.encode()])
    coloured = bool(rng.uniform() < 0.5)
    world = draw_world(rng, FAMILIES[family], coloured=coloured)
    logs, key = conceal(rng, world, plan)
    key = {"effect": None, "states": []} | key | {"family": family, "kind": plan.kind} | _facts(world)
    title = name or f"{world.machine.title} {seed}"
    return Case(case_files(title, world, logs, stated=bool(rng.uniform() < 0.5)), key)


def _facts(world: World) -> Key:
    return {
        "coloured": world.coloured,
        "noise": world.sigma.round(4).tolist(),
        "lumping_over_noise": round(world.lumping, 3),
        "also_true": [
            {"effect": effect, "states": list(states), "rms_over_noise": round(rms, 3)}
            | ({"also": list(also)} if (also := EFFECTS[effect].also) else {})
            for effect, states, rms in world.lacks
        ],
    }


def conceal(rng: Draw, world: World, plan: Plan) -> tuple[dict[str, Columns], Key]:
    """The noisy logs of a world with what the plan says concealed in it, and the key."""
    if plan.kind == "none":
        return world.logs(world.machine, noisy=True), {}
    if plan.kind == "measuring":
        return _measuring(rng, world, plan.word)
    if plan.kind == "two":
        return _two(rng, world)
    effect = OUTSIDE[int(plan.word)] if plan.kind == "outside" else EFFECTS[plan.word]
    machine, key = sized(rng, world, effect, SIZES)
    logs = world.logs(machine, noisy=True)
    return logs, with_size(world, machine, key)


def with_size(world: World, machine: Machine, key: Key) -> Key:
    """The key with the rms that a full refit leaves; below the noise `no mismatch` is accepted."""
    rms = world.visible(world.logs(machine, FIT))
    accepts = [*key.get("accepts", []), *(["no mismatch"] if rms < VISIBLE else [])]
    return key | {"rms_over_noise": round(rms, 3)} | ({"accepts": accepts} if accepts else {})


def sized(
    rng: Draw, world: World, effect: Effect, sizes: tuple[float, float], avoid: tuple[str, ...] = ()
) -> tuple[Machine, Key]:
    """A machine with an effect as large as a target drawn from `sizes`, at a random place where it can be.

    If physics allows it at none of three places, it stands where it is seen best.
    """
    machine, target = world.machine, float(np.exp(rng.uniform(*np.log(sizes))))
    places = [p for p in effect.places(machine) if not set(p) & set(avoid)] or effect.places(machine)
    found = []
    for k in rng.permutation(len(places))[:3]:
        at, shapes = places[int(k)], Shapes(rng)

        def make(size: float, at: Place = at, shapes: Shapes = shapes) -> Machine:
            return effect.conceal(machine, at, size, shapes)

        size, reached = _size_for(world, make, effect.reach(machine, at), target)
        found.append((min(reached, target), at, size, shapes))
        if reached > 0.8 * target:
            break
    _, at, size, shapes = max(found, key=lambda one: one[0])
    return effect.conceal(machine, at, size, shapes), _identity(world, effect, at, size, shapes)


def _size_for(
    world: World, make: Callable[[float], Machine], most: float, target: float
) -> tuple[float, float]:
    """The size with three digits, up to `most`, of which a refit leaves about `target`; and what it leaves.

    More is not always seen better: a body tied fast enough is one with its neighbour, which a refit absorbs.
    """
    sizes = most * np.array([0.01, 0.04, 0.15, 0.5, 1.0])
    left: list[float] = []
    for size in sizes.tolist():
        left.append(world.size(make(size)))
        if left[-1] > target or (len(left) > 1 and left[-1] < 0.9 * left[-2]):
            break
    k = int(np.argmax(left))
    size, reached = float(sizes[k]), left[k]
    if reached > target:
        low, seen = (float(sizes[k - 1]), left[k - 1]) if k else (0.0, 0.0)
        size, reached = low + (size - low) * (target - seen) / (reached - seen), target
    return float(f"{size:.3g}"), reached


def _identity(world: World, effect: Effect, at: Place, size: float, shapes: Shapes) -> Key:
    of_output = at[0] in world.machine.outputs
    key: Key = {"effect": effect.word, "states": [] if of_output else list(at)}
    key |= {"output": at[0]} if of_output else {}
    key |= {"size": size, "unit": effect.unit}
    key |= {"top_speed": world.machine.words.top_speed} if world.machine.words.speed else {}  # rpm
    key |= {"also": list(effect.also)} if effect.also else {}
    accepts = list(effect.accepts)
    if effect.word == "second_thermal_mass" and shapes.values["cells"] >= 2.5:
        accepts.append("unexplained")  # heat that diffuses is not one mass
    key |= {"accepts": accepts} if accepts else {}
    if "recording" in shapes.values:
        start, end, _ = window(world.machine, shapes, world.machine.pace.hours * 3600.0)
        recording = RECORDINGS[int(shapes.values["recording"])]
        key |= {"recording": recording, "window": [recording, round(start), round(end)]}
    if effect.word.startswith("input_"):
        key["input"] = next(
            s.channel for s in world.machine.spare if s.kind == effect.word and at[0] in (s.body, s.output)
        )
    return key | {"shape": {name: float(f"{v:.4g}") for name, v in shapes.values.items()}}


def _two(rng: Draw, world: World) -> tuple[dict[str, Columns], Key]:
    """Two effects of their own words and bodies, each well visible next to what is there already."""
    possible = [e for e in EFFECTS.values() if e.places(world.machine) and e.word not in ALONE]
    both, keys = world, list[Key]()
    for k in rng.permutation(len(possible)):
        taken = tuple(body for key in keys for body in (*key["states"], key.get("output", "")))
        machine, key = sized(rng, both, possible[int(k)], OF_TWO, taken)
        here = {*key["states"], key.get("output", "")}
        size = both.size(machine)
        if size < VISIBLE or here & set(taken):
            continue
        both, keys = replace(both, machine=machine), [*keys, key | {"rms_over_noise": round(size, 3)}]
        if len(keys) == 2:
            break
    accepts = ["unexplained"] if any("unexplained" in key.get("accepts", ()) for key in keys) else []
    key = {"effect": "two", "states": [], "effects": keys} | ({"accepts": accepts} if accepts else {})
    return world.logs(both.machine, noisy=True), with_size(world, both.machine, key)


def _measuring(rng: Draw, world: World, word: str) -> tuple[dict[str, Columns], Key]:
    """A fault of the measuring chain, well above noise: a lag in all recordings, others in one to fit."""
    outputs, seconds = world.machine.outputs, world.machine.pace.hours * 3600.0
    j, where = int(rng.integers(len(outputs))), FIT[int(rng.integers(len(FIT)))]
    sigma, sign = world.sigma, float(rng.choice([-1.0, 1.0]))
    at = round(float(rng.uniform(0.15, 0.85) * seconds))
    key: Key = {"effect": word, "states": [], "output": outputs[j], "recording": where}
    machine = world.machine
    change: Callable[[Columns], Columns]
    if word == "sensor_lag":
        tau = float(f"{seconds * rng.uniform(0.004, 0.02):.3g}")
        machine = replace(machine, shown=(*machine.shown, partial(faults.lagging, j, tau)))
        del key["recording"]
        return world.logs(machine, noisy=True), with_size(world, machine, key | {"size": tau, "unit": "s"})
    if word == "clock_shift":
        size = 60.0 * max(1, round(seconds / 72.0 / 3600.0 * rng.integers(10, 40)))
        change, more = partial(faults.clock_shift, outputs=outputs, size=size), {"size": size, "unit": "s"}
        del key["output"]
    elif word == "rezero":
        jumps = {
            o: float(f"{s * rng.choice([-1, 1]) * rng.uniform(3, 9):.3g}")
            for o, s in zip(outputs, sigma, strict=True)
        }
        change, more = partial(faults.rezero, jumps=jumps, at_s=at), {"jumps": jumps, "at_s": at}
        del key["output"]
    elif word == "sensor_gain":
        unit = next(c.unit for c in machine.channels if c.name == outputs[j])
        about = machine.words.air if unit == "degC" else ""
        moved = world.logs(machine, FIT)[where]
        rms = np.sqrt(np.nanmean((moved[outputs[j]] - (moved[about] if about else 0.0)) ** 2))
        size = float(f"{sign * min(0.4, sigma[j] * rng.uniform(3.0, 9.0) / rms):.3g}")
        change, more = partial(faults.sensor_gain, channel=outputs[j], size=size, about=about), {"size": size}
    else:
        low, high = {"outlier": (15.0, 60.0), "sensor_drift": (5.0, 12.0)}.get(word, (3.0, 9.0))
        size = (
            sign
            * sigma[j]
            * rng.uniform(low, high)
            * (faults.DAY / seconds if word == "sensor_drift" else 1.0)
        )
        size, at = float(f"{size:.3g}"), 0 if word == "sensor_drift" else at
        change = partial(getattr(faults, word), channel=outputs[j], size=size, at_s=at)
        more = {"size": size, "unit": "a day" if word == "sensor_drift" else "", "at_s": at}
    clean = world.logs(machine, FIT)
    size_of = world.visible(clean | {where: change(clean[where])})
    noisy = world.logs(machine, noisy=True)
    return noisy | {where: change(noisy[where])}, key | more | {"rms_over_noise": round(size_of, 3)}
