"""Patterns of inputs for the next experiment, in words and as series."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis.context import Context
from discovery.models.units import same_dimension
from discovery.printed import lasting
from discovery.recordings import Channel

Array = NDArray[np.float64]

_SET = ("rotation speed", "heat load", "cooling power", "fluid flow", "other input")


def patterns(context: Context, time: Array) -> dict[str, Mapping[str, Array]]:
    """Patterns in words, each input at the instants of the pattern: of what this machine has to be moved.
    What nobody sets, as the room, stays where it was when the first recording began.

    Args:
        time: (T,) instants of the patterns, s, from zero on.
    """
    length = float(time[-1])
    channels = context.campaign.channels
    series = {
        n: np.concatenate([context.grids[r].samples[n].value for r in context.recordings])
        for n in context.grids[context.recordings[0]].samples
    }
    roles = {n: channels[n].role for n in series}
    wet = {"fluid flow", "fluid temperature"} <= set(roles.values())  # else what flows is a coolant

    def build(speed: Array, load: Array, pump: Array, warm: bool) -> dict[str, Array]:
        share = {
            "rotation speed": speed,
            "heat load": load,
            "cooling power": load,
            "fluid flow": pump if wet else np.ones(len(time)),
            "fluid temperature": np.ones(len(time)) if warm else None,
        }
        out = {}
        for n, role in roles.items():
            moved = share.get(role)
            usual = np.median(series[n]) if _is_set(channels[n]) else series[n][0]
            level = np.quantile(series[n], 0.95) if moved is not None else usual
            out[n] = level * (np.ones(len(time)) if moved is None else moved)
        return out

    zero, one, first = np.zeros(len(time)), np.ones(len(time)), (time < length / 2).astype(float)
    sixth, twelfth = (((time // (length / n)) % 2 == 0).astype(float) for n in (6, 12))
    speed, load = (r in roles.values() for r in ("rotation speed", "heat load"))

    def called(role: str, word: str) -> str:
        """The only channel of a role by its name, several by a word."""
        mine = [n for n, one in roles.items() if one == role]
        return mine[0] if len(mine) == 1 else word

    names = called("rotation speed", "speed"), called("heat load", "load")
    moving = " and ".join(name for name, there in zip(names, (speed, load), strict=True) if there)
    dry, still = ", dry" if wet else "", "stand still" if speed else "leave everything off"
    half, two, hour = (lasting(length / n) for n in (2, 6, 12))
    wanted: dict[str, Mapping[str, Array]] = {}
    if wet:
        wanted[f"switch the pump every {two} at standstill with warm fluid"] = build(zero, zero, sixth, True)
    if wet and moving:
        wanted[f"switch the pump every {two} at full {moving}"] = build(one, one, sixth, False)
        wanted[f"step {moving} every {hour} with the pump running"] = build(twelfth, twelfth, one, False)
    if moving:
        wanted[f"run {half} at full {moving}{dry}, then {still} for {half}"] = build(
            first, first, zero, False
        )
        wanted[f"step {moving} every {hour}{dry}"] = build(twelfth, twelfth, zero, False)
    if speed and load:
        wanted[f"run at half {names[0]} and full {names[1]}{dry}"] = build(0.5 * one, one, zero, False)
    wanted[f"{still} and follow the room"] = build(zero, zero, zero, False)
    stepped = ("other input",) if wet else ("other input", "fluid flow")  # a coolant never stays off
    for n in (n for n, role in roles.items() if role in stepped and _is_set(channels[n])):
        low, high = np.quantile(series[n], (0.05, 0.95))
        if high > low:
            wanted[f"step {n} every {hour}{dry}"] = {
                **build(zero, zero, zero, False),
                n: low + (high - low) * twelfth,
            }
    for n in (n for n, role in roles.items() if role in _SET and _is_set(channels[n])):
        low, high = _levels(series[n])
        if high > low:
            levels = f"{n} between {low:.3g} and {high:.3g}"
            wanted[f"step {levels} every {hour}, everything else on"] = {
                **build(one, one, one, False),
                n: low + (high - low) * twelfth,
            }
    return wanted


def _levels(series: Array) -> tuple[float, float]:
    """The lowest and highest value (5 and 95 %) that an input has while it is on; a switch is off and on."""
    on = series[series != 0.0]
    low, high = (float(q) for q in np.quantile(on, (0.05, 0.95))) if len(on) else (0.0, 0.0)
    return (low, high) if high > low else (min(0.0, low), max(0.0, high))


def _is_set(channel: Channel) -> bool:
    """Whether somebody sets an input: it stays until it is set anew. What moves in between, as a temperature,
    is only measured, and nobody steps the sun.
    """
    return channel.between == "held" and not same_dimension(channel.unit, "W/m**2")
