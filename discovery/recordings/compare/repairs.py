"""Damages of recordings that are known from shop floors, each with what undoes it.

A damage is named where undoing it makes a recording agree with the others (`agreement`). A new one is a
further function that yields repairs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen


@dataclass(frozen=True)
class Repair:
    """`kind`: word of the damage. `channels`: whose readings change, () where the clock does. `what`,
    `do`: as in a finding. `made`: the recording repaired.
    """

    kind: str
    channels: tuple[str, ...]
    what: str
    do: str
    made: Seen


@dataclass(frozen=True)
class Disagreement:
    """A repair that makes a recording agree: misfit before and after, in parts of the movement."""

    recording: str
    repair: Repair
    before: float
    after: float
    usual: float
    gain: float


_FACTORS: dict[str, tuple[tuple[float, str, str], ...]] = {
    "error": ((1e3, "mm", "um"), (1e-3, "nm", "um"), (25.4e3, "inches", "um")),
    "heat load": ((1e3, "kW", "W"), (1e-3, "mW", "W"), (745.7, "hp", "W")),
    "cooling power": ((1e3, "kW", "W"), (1e-3, "mW", "W")),
    "rotation speed": (
        (60.0, "1/s", "rpm"),
        (1 / 60.0, "1/h", "rpm"),
        (9.549, "rad/s", "rpm"),
        (1e3, "1000 rpm", "rpm"),
    ),
    "fluid flow": (
        (1 / 60.0, "l/h", "l/min"),
        (16.667, "m3/h", "l/min"),
        (60.0, "l/s", "l/min"),
        (100.0, "shares", "percent"),
        (0.01, "percent", "shares"),
    ),
}
_ANY_FACTORS = (
    (1e3, "1000 times too small"),
    (1e-3, "1000 times too large"),
    (10.0, "10 times too small"),
    (0.1, "10 times too large"),
    (100.0, "100 times too small"),
    (0.01, "100 times too large"),
    (2.0, "half as large"),
    (0.5, "twice as large"),
)
_SCALES: tuple[tuple[str, float, float], ...] = (
    ("degF", 5 / 9, -160 / 9),
    ("K", 1.0, -273.15),
)
_CLOCKS = (
    (60.0, "minutes"),
    (3600.0, "hours"),
    (1e-3, "milliseconds"),
    (86400.0, "days"),
    (1 / 60.0, "sixtieths of a second"),
)
_OFF = 5.0  # K: what siblings differ by when a machine is cold
_SWITCHED = 0.95  # of the readings of a switch are 0 or 1
_WHEN = tuple(np.linspace(0.1, 0.9, 17))  # of a recording: where a damage may begin

Channels = Mapping[str, Channel]
Family = Callable[[Seen, Channels, Sequence[str], Sequence[str]], Iterator[Repair]]


def all_repairs(
    one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]
) -> Iterator[Repair]:
    """Every repair of a recording that is known, but for shifts, whose size has to be found (`shifted`)."""
    for family in (units, signs, swaps, clocks, halves, levels):
        yield from family(one, channels, inputs, outputs)


def units(one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Repair]:
    """A channel in another unit than the campaign says, or a decimal point that slipped."""
    for name in _moving(one, [*inputs, *outputs]):
        channel, values = channels[name], one.values[name]
        if is_switch(values):
            continue
        if channel.unit == "degC":
            for unit, factor, offset in _SCALES:
                what, do = f"'{name}' looks like {unit} read as degC", f'state unit = "{unit}", or convert it'
                yield Repair("unit", (name,), what, do, one.having({name: factor * values + offset}))
            continue
        named = _FACTORS.get(channel.role, ())
        for factor, unit, meant in named:
            what = f"'{name}' looks like {unit} read as {meant}"
            do = f"multiply it by {factor:g}, or state its unit"
            yield Repair("unit", (name,), what, do, one.having({name: factor * values}))
        for factor, words in _ANY_FACTORS:
            if not any(abs(factor / f - 1) < 0.01 for f, _, _ in named):
                what = f"'{name}' is {words} compared with the other recordings"
                do = "check its unit and scale"
                yield Repair("factor", (name,), what, do, one.having({name: factor * values}))


def signs(one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Repair]:
    """A channel with the other sign; a switch the other way round."""
    for name in _moving(one, [*inputs, *outputs]):
        values = one.values[name]
        if is_switch(values):
            what, do = f"'{name}' is 1 where it should be 0", "invert the switch"
            yield Repair("sign", (name,), what, do, one.having({name: 1.0 - values}))
        elif channels[name].unit != "degC":
            what, do = f"'{name}' has the other sign than in the other recordings", "change its sign"
            yield Repair("sign", (name,), what, do, one.having({name: -values}))


def swaps(one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Repair]:
    """Two channels in each other's columns. Readings that only settle, with no input moving, cannot say."""
    for group in (inputs, outputs if _moving(one, inputs) else ()):
        # of the two one may stand still here: a heater that was off
        names, moving = _recorded(one, group), set(_moving(one, group))
        for k, a in enumerate(names):
            for b in names[k + 1 :]:
                kinds = {channels[a].unit == "degC", channels[b].unit == "degC"}
                if len(kinds) == 2 or not {a, b} & moving:
                    continue
                what, do = f"'{a}' and '{b}' are swapped", "change their columns"
                yield Repair("swap", (a, b), what, do, one.having({a: one.values[b], b: one.values[a]}))


def shifted(one: Seen, group: Sequence[str], channels: Channels, seconds: float) -> Repair:
    """A channel, all readings, or all inputs that are set, late (early if below zero) by so many seconds."""
    names = ", ".join(f"'{name}'" for name in group)
    said = (
        f"{names} is"
        if len(group) == 1
        else "the readings are"
        if channels[group[0]].measured
        else f"{names} are"
    )
    when = "late" if seconds > 0 else "early"
    what = f"{said} {_duration(abs(seconds))} {when} compared with the other channels"
    moved = {name: _moved(one.time, one.values[name], seconds) for name in group if name in one.values}
    return Repair("shift", tuple(group), what, "check the clock of its logger", one.having(moved))


def paced(one: Seen, factor: float) -> Repair:
    """A clock that counts another time than has passed, by a factor of any size."""
    side = "fast" if factor < 1.0 else "slow"
    what = f"its clock runs about {abs(1.0 / factor - 1.0):.0%} {side} compared with the other recordings"
    return Repair(
        "pace", (), what, "check the interval of its logger", one.having({}, time=factor * one.time)
    )


def drifting(one: Seen, name: str, per_second: float, unit: str, rivals: Sequence[str] = ()) -> Repair:
    """An output that creeps away by so much a second; `rivals`: inputs that explain it as well."""
    whole = per_second * float(one.time[-1])
    made = one.values[name] - per_second * one.time
    what = f"'{name}' drifts by {whole:.3g} {unit} over the recording{_or(rivals)}"
    do = f"check its zero and its holder{_scale_of(rivals)}"
    return Repair("drift", (name,), what, do, one.having({name: made}))


def _or(rivals: Sequence[str]) -> str:
    """What else an output may follow that others do not predict."""
    if not rivals:
        return "; no recorded input explains it"
    inputs = " or ".join(f"'{name}'" for name in rivals)
    return f", or {inputs} is larger or smaller than recorded, in this recording or in the others"


def _scale_of(rivals: Sequence[str]) -> str:
    inputs = " and ".join(f"'{name}'" for name in rivals)
    return f", and the scale of {inputs}" if rivals else ""


def offset(one: Seen, name: str, since: float, size: float, unit: str, rivals: Sequence[str] = ()) -> Repair:
    """An output that is higher (lower where below zero) by so much from an instant [s] on; `rivals`: inputs
    that explain it as well.
    """
    made = one.values[name] - size * (one.time > since)
    side = "higher" if size > 0 else "lower"
    at = _duration(since)
    what = f"'{name}' is {abs(size):.3g} {unit} {side} from {at} on{_or(rivals)}"
    do = f"check the sensor and its holder{_scale_of(rivals)}; split the recording there"
    return Repair("offset", (name,), what, do, one.having({name: made}))


def shiftable(
    one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]
) -> list[tuple[str, ...]]:
    """Channels that may be late by themselves, and those of one logger: all readings, or all inputs that are
    set where others are measured. Without others, late inputs are early readings.
    """
    held = [name for name in _moving(one, inputs) if channels[name].between == "held"]
    groups: list[tuple[str, ...]] = [(name,) for name in [*held, *_moving(one, outputs)]]
    groups += [tuple(outputs)] if len(outputs) > 1 else []
    return groups + ([tuple(held)] if 1 < len(held) < len(_moving(one, inputs)) else [])


def levels(one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Repair]:
    """A thermometer that is off by what it differs from its siblings at the beginning."""
    first = {
        name: float(np.median(one.known(name)[1][:5]))
        for name in _recorded(one, [*inputs, *outputs])
        if channels[name].is_sensor and channels[name].unit == "degC" and one.known(name)[1].size
    }
    for name in _moving(one, [n for n in inputs if n in first]):
        siblings = [value for other, value in first.items() if other != name]
        away = first[name] - float(np.median(siblings)) if len(siblings) > 1 else 0.0
        if abs(away) > _OFF:
            what = f"'{name}' is {abs(away):.2g} K too {'high' if away > 0 else 'low'} throughout"
            do = "look at the sensor, its unit and its contact"
            yield Repair("level", (name,), what, do, one.having({name: one.values[name] - away}))


def clocks(one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Repair]:
    """A clock that counts in something else than seconds."""
    del channels, inputs, outputs
    for factor, unit in _CLOCKS:
        what, do = f"its time looks like {unit} read as seconds", f"multiply the time by {factor:g}"
        yield Repair("time", (), what, do, one.having({}, time=factor * one.time))


def halves(one: Seen, channels: Channels, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Repair]:
    """A channel whose sign or unit changes in the middle of a recording."""
    length = float(one.time[-1])
    for name in _moving(one, [*outputs, *inputs]):
        values, channel = one.values[name], channels[name]
        if is_switch(values):
            continue
        changes: list[tuple[str, float, float]] = []
        if channel.unit == "degC":
            changes = [("is in Fahrenheit", 5 / 9, -160 / 9)]
        else:
            changes = [
                ("has the other sign", -1.0, 0.0),
                ("is 1000 times too small", 1e3, 0.0),
                ("is 1000 times too large", 1e-3, 0.0),
                ("is 10 times too small", 10.0, 0.0),
                ("is 10 times too large", 0.1, 0.0),
            ]
        for share in _WHEN:
            after = one.time > share * length
            for words, factor, offset in changes:
                made = np.where(after, factor * values + offset, values)
                what = f"'{name}' {words} from {_duration(share * length)} on"
                yield Repair(
                    "halfway",
                    (name,),
                    what,
                    "split the recording there, or correct it",
                    one.having({name: made}),
                )


def _recorded(one: Seen, names: Sequence[str]) -> list[str]:
    return [n for n in names if n in one.values and n not in one.constant]


def _moving(one: Seen, names: Sequence[str]) -> list[str]:
    return [n for n in _recorded(one, names) if _moves(one.values[n])]


def _moves(values: Array) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() < known.max())


def is_switch(values: Array) -> bool:
    """Whether a channel is 0 or 1, but for a few rows in which it was switched: a row is a mean."""
    known = values[np.isfinite(values)]
    if known.size == 0 or known.min() < 0.0 or known.max() > 1.0:
        return False
    return bool(np.mean(np.isin(known, (0.0, 1.0))) >= _SWITCHED)


def _moved(time: Array, values: Array, seconds: float) -> Array:
    """A channel as it was `seconds` later, at the stamps of its readings, NaN where nothing is known."""
    known = np.isfinite(values)
    if not known.any():
        return values
    found = np.full(len(values), np.nan)
    at = time[known] + seconds
    inside = (at >= time[known][0]) & (at <= time[known][-1])
    found[np.flatnonzero(known)[inside]] = np.interp(at[inside], time[known], values[known])
    return found


def _duration(seconds: float) -> str:
    return (
        f"{seconds / 3600:.2g} h"
        if seconds >= 5400
        else f"{seconds / 60:.2g} min"
        if seconds >= 90
        else f"{seconds:.2g} s"
    )
