"""A case: a machine as a logger records it, its hand-built model, its true physics and its key."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .network import Array

AMBIENT, COOLANT, FLUID = "ambient temperature", "coolant temperature", "fluid temperature"
TEMPERATURE, ERROR = "temperature", "error"
FLOW, SPEED, HEAT, OTHER = "fluid flow", "rotation speed", "heat load", "other input"
OUTPUTS = {TEMPERATURE, ERROR}
THERMOMETERS = {AMBIENT, COOLANT, FLUID, TEMPERATURE}

Physics = frozenset[str]
Signals = dict[str, Array]
Key = Mapping[str, Any]
Simulate = Callable[[np.random.Generator, int, str, Physics], Signals]
"""True values (N,) of all channels from random numbers, steps, recording and what acts."""


@dataclass(frozen=True)
class Channel:
    """How a quantity is read. `gain` and `zero` are standard deviations of what a sensor is off by.

    Args:
        role: of the channel in the campaign.
        unit: of the channel.
        noise: standard deviation of a reading, in `unit`.
        step: resolution, in `unit`.
        lag: time constant of the sensor [s].
        gain: error of calibration, as a share.
        zero: error at 22 degC, in `unit`.
        relative: noise as a share of the reading.
    """

    role: str
    unit: str
    noise: float = 0.0
    step: float = 0.0
    lag: float = 0.0
    gain: float = 0.0
    zero: float = 0.0
    relative: float = 0.0


def thermometer(
    *, noise: float, step: float, lag: float, zero: float, role: str = TEMPERATURE, gain: float = 0.01
) -> Channel:
    """A thermometer on a body or in a coolant: noise, resolution and zero in K, lag in s."""
    return Channel(role, "degC", noise, step, lag, gain, zero)


def ambient(*, noise: float, step: float, lag: float, zero: float) -> Channel:
    """The thermometer of the room: noise, resolution and zero in K, lag in s."""
    return thermometer(noise=noise, step=step, lag=lag, zero=zero, role=AMBIENT, gain=0.005)


def power(*, relative: float, step: float, unit: str = "W", role: str = HEAT) -> Channel:
    """A recorded power or current: noise as a share of the reading, resolution in `unit`."""
    return Channel(role, unit, step=step, gain=0.01, relative=relative)


def error(*, noise: float, step: float = 0.1, unit: str = "um") -> Channel:
    """A measured thermal error: noise and resolution in `unit`."""
    return Channel(ERROR, unit, noise, step, gain=0.01)


def switch(role: str = OTHER) -> Channel:
    """A switch: 0 or 1."""
    return Channel(role, "1")


def free(name: str, start: float, unit: str, low: float | None = 0.0, high: float | None = None) -> str:
    """A line of a parameter of the model, with its start value and its limits."""
    limits = "".join(f", {word} = {end}" for word, end in (("min", low), ("max", high)) if end is not None)
    return f'{name} = {{ start = {start}, unit = "{unit}"{limits} }}\n'


@dataclass(frozen=True)
class Machine:
    """What is recorded of a machine, and the model that an engineer wrote of it.

    Args:
        channels: by name, in the order of the columns.
        parameters: lines of the model.
        states: heat capacities by state [J/K]. One that is not read starts at the temperature of the room.
        terms: into, from (may be empty) and expression of each term.
        outputs: what is fitted, with its expression; a state that is read is its own expression.
        every: interval of the logger [s].
        hours: length of each recording [h].
        late: age of a recorded input at its stamp, as a share of the interval.
        runs: names of the recordings; the last one is held out.
    """

    channels: Mapping[str, Channel]
    parameters: str
    states: Mapping[str, float]
    terms: Sequence[tuple[str, str, str]]
    outputs: Mapping[str, str]
    every: int
    hours: Sequence[float]
    late: float
    runs: Sequence[str] = ("a", "b", "c", "d")


@dataclass(frozen=True)
class Case:
    """A machine with its true physics.

    Args:
        machine: what is recorded, and its model.
        simulate: the truth.
        key: what the model lacks, for the score.
        lacks: physics that acts and that the model does not have.
        knows: physics that acts and that the model has, where other cases of the machine lack it.
    """

    machine: Machine
    simulate: Simulate
    key: Key
    lacks: Physics = frozenset()
    knows: Physics = frozenset()


NOTHING: Key = {"effect": None, "states": []}


def effect(name: str, *states: str, **more: Any) -> Key:
    """Key of one effect. `also` lists effects that are right as well, `accepts` verdicts."""
    return {"effect": name, "states": list(states), **more}


def two_effects(*effects: tuple[str, Sequence[str]]) -> Key:
    """Key of two effects with their places."""
    each = [{"effect": name, "states": list(places)} for name, places in effects]
    return {"effect": "two", "effects": each, "states": []}


def read(*names: str) -> dict[str, str]:
    """Outputs that show a state as it is."""
    return {name: name for name in names}
