"""What a case conceals: an effect, two, or something that no catalogue holds, drawn and brought to a size.

The size of a case is what a refit of the baseline leaves of the effect: rms on the recordings to fit, over
noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discovery.virtual import chains, laws, outside
from discovery.virtual.fine import BODIES, Array
from discovery.virtual.laws import Concealed
from discovery.virtual.world import FIT, RECORDINGS, World

ATTEMPTS = 12  # draws of an effect that can reach the size wanted

Found = tuple[Array, dict[str, Any]]  # readings with what is concealed, and its key


def _sized(world: World, base: Array, effect: Concealed, wanted: float) -> tuple[float, Array]:
    """Size with which a refit leaves `wanted`, and the readings with it; at most the physical limit."""
    size, readings = effect.trial, base
    for _ in range(6):
        readings = world.readings([effect.laws(size, u) for u in world.inputs])
        reached = max(world.size_of(readings - base), 1e-9)
        if abs(np.log(reached / wanted)) < 0.05 or (size == effect.limit and reached < wanted):
            break
        size = float(min(effect.limit, size * np.clip(wanted / reached, 0.1, 10.0)))
    return float(f"{size:.5g}"), readings


def _one(rng: np.random.Generator, world: World, base: Array) -> Found:
    """An effect of the catalogue, drawn until one can reach the size wanted without being unphysical."""
    wanted = float(np.exp(rng.uniform(np.log(0.5), np.log(4.0))))
    for attempt in range(ATTEMPTS):
        k = int(rng.integers(len(laws.ONE) + 1))
        if k == len(laws.ONE):
            break
        effect = laws.ONE[k](rng, world.plant.machine)
        size, readings = _sized(world, base, effect, wanted)
        if world.size_of(readings - base) > (0.9 * wanted if attempt < ATTEMPTS // 2 else 0.47):
            return readings, _key_of(world, effect, size, readings - base)
    return _window(rng, world, base, wanted)


def _window(rng: np.random.Generator, world: World, base: Array, wanted: float) -> Found:
    """Heat of unknown cause for some hours in one recording to fit."""
    where, body = int(rng.integers(len(FIT))), int(rng.integers(5))
    shape, start, end = outside.window_of_heat(rng, len(world.inputs[0].air))

    def readings(size: float) -> Array:
        heated = chains.Law(chains.HEAT, body, -1, size * shape, shape)
        return world.readings([[heated] if k == where else [] for k in range(len(RECORDINGS))])

    size = float(f"{100.0 * wanted / world.size_of(readings(100.0) - base):.5g}")
    effect = Concealed(
        "unmeasured_heat", (BODIES[body],), laws.body_law(chains.HEAT, body, laws.always), "W", size, size
    )
    change = readings(size) - base
    return base + change, _key_of(world, effect, size, change) | {"window": [RECORDINGS[where], start, end]}


def _two(rng: np.random.Generator, world: World, base: Array) -> Found:
    """Two different effects at different bodies, each of size 1 to 3."""
    chosen: list[tuple[Concealed, float, float]] = []
    while len(chosen) < 2:
        effect = laws.ONE[int(rng.integers(len(laws.ONE)))](rng, world.plant.machine)
        if any(effect.effect == c.effect or set(effect.states) & set(c.states) for c, _, _ in chosen):
            continue
        size, readings = _sized(world, base, effect, float(rng.uniform(1.0, 3.0)))
        alone = world.size_of(readings - base)
        if alone > 0.8:
            chosen.append((effect, size, alone))
    readings = world.readings(
        [[law for e, size, _ in chosen for law in e.laws(size, u)] for u in world.inputs]
    )
    each = [_identity(e, size) | {"rms_over_noise": round(alone, 3)} for e, size, alone in chosen]
    both = round(world.size_of(readings - base), 3)
    return readings, {"effect": "two", "effects": each, "rms_over_noise": both}


def _outside(rng: np.random.Generator, world: World, base: Array) -> Found:
    """Something that no catalogue holds."""
    wanted = float(np.exp(rng.uniform(np.log(0.8), np.log(4.0))))
    kind = int(rng.integers(len(outside.OUTSIDE) + 1))
    for _ in range(ATTEMPTS if kind < len(outside.OUTSIDE) else 0):
        effect = outside.OUTSIDE[kind](rng, world.plant.machine)
        size, readings = _sized(world, base, effect, wanted)
        if world.size_of(readings - base) > 0.6:
            return readings, _key_of(world, effect, size, readings - base)
    return _odd_joint(rng, world, base, wanted)


def _odd_joint(rng: np.random.Generator, world: World, base: Array, wanted: float) -> Found:
    """A joint of unusual shape: it changes what the readings show, not the temperatures."""
    body, creep = int(rng.integers(1, 4)), float(rng.uniform(0.0003, 0.002))
    bodies = world.bodies()

    def readings(width: float) -> Array:
        slipping = [b.copy() for b in bodies]
        for b in slipping:
            b[:, body] = outside.odd_joint(b[:, body], width, creep)
        return world.shown(slipping)

    width = 0.3
    for _ in range(5):
        width = float(np.clip(width * wanted / max(world.size_of(readings(width) - base), 1e-9), 0.02, 3.0))
    width = float(f"{width:.5g}")
    law = laws.body_law(chains.HEAT, body, laws.always)
    effect = Concealed("out of catalogue", (BODIES[body],), law, "K", width, 3.0, accepts=("unexplained",),
                       also=("joint_hysteresis",))  # fmt: skip
    change = readings(width) - base
    return base + change, _key_of(world, effect, width, change)


MAKERS = {"one": _one, "two": _two, "outside": _outside}


def _identity(effect: Concealed, size: float) -> dict[str, Any]:
    """Name, place, size and shape in the words of a key."""
    shape = {name: float(f"{value:.5g}") for name, value in effect.shape.items()}
    lists = {"accepts": list(effect.accepts), "also": list(effect.also)}
    return {
        "effect": effect.effect,
        "states": list(effect.states),
        "size": size,
        "unit": effect.unit,
        "regime": effect.regime,
        **shape,
        **{name: words for name, words in lists.items() if words},
    }


def _key_of(world: World, effect: Concealed, size: float, change: Array) -> dict[str, Any]:
    return _identity(effect, size) | {"rms_over_noise": round(world.size_of(change), 3)}
