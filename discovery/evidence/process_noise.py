"""Everyday noise, with which tests reckon: of readings, slow sensors, unrecorded heat and late switches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.fitting import Fit, Noise
from discovery.fitting.noise import resolution
from discovery.mismatch.lens import Lens
from discovery.models import Model

Array = NDArray[np.float64]

EVERYDAY_HEAT = 4.0  # W rms at a body that no machine is free of
LEAST_HEAT = 0.1  # of that, below which no model of a few bodies is exact
BUSY_FLOW = 100.0  # W; a model whose largest heat flow is smaller has a smaller everyday heat
JITTER = 12**-0.5  # of a logging interval: a switch that comes anywhere in it
SLOW_LIMIT = 0.55  # everyday slow sensor noise, as a share of the reading noise


def heat_limit(model: Model, flows: Mapping[str, float]) -> dict[str, float]:
    """What no state is free of: W at a body, a rate at a state without capacity, driven or not.

    Heat flows and rates are never compared: the bed of a machine follows the room at 1e-5 K/s beside bodies
    that take 300 W.
    """
    states = {name: state for name, state in model.states.items() if not state.memory}
    busiest = max((flows.get(name, 0.0) for name, state in states.items() if state.capacity), default=1.0)
    fastest = max((flows.get(name, 0.0) for name, state in states.items() if not state.capacity), default=0.0)
    return {
        name: EVERYDAY_HEAT * min(1.0, busiest / BUSY_FLOW)
        if state.capacity
        else 0.04 * max(flows.get(name, 0.0), 0.1 * fastest)
        for name, state in states.items()
    }


def everyday(white: Noise, limit: Mapping[str, float], unsure: bool = False) -> tuple[Noise, ...]:
    """The noise settings that evidence is integrated over: slow noise from none and heat from next to none
    to the everyday limit. None at all there is not: a few bodies never stand for a machine to the last
    fraction of a watt, and readings without other noise would call what is left an effect.

    Args:
        unsure: inputs may be logged late, each switch by another time, or all by the same.
    """
    return tuple(
        replace(
            white,
            slow=tuple(share * w for w in white.white),
            heat={name: level * value for name, value in limit.items()},
            jitter=jitter,
        )
        for jitter in ((0.0, JITTER) if unsure else (0.0,))
        for share in (0.0, 0.5 * SLOW_LIMIT, SLOW_LIMIT)
        for level in (LEAST_HEAT, 0.35, 0.9)
    )


def reading_noise(
    fit: Fit, stated: Mapping[str, float | None], limit: Mapping[str, float], duration: float
) -> Noise:
    """White reading noise: what is stated, else the most likely level beside slow noise and heat of any size.

    Heat far above the everyday level is offered, so that a mismatch passes for heat and not for reading
    noise. Time constants of everyday noise are 2 and 3 h, or a fixed share of shorter recordings.
    """
    outputs = fit.problem.outputs
    known = np.array([stated.get(name) is not None for name in outputs])
    slow_time, heat_time = min(7200.0, duration / 12), min(10800.0, duration / 8)
    best, lowest = np.array(fit.noise.white), np.inf
    if not known.all():
        lens, least = Lens(fit), np.array(resolution([s.grid.readings for s in fit.problem.systems]))
        for share in (0.0, 0.5 * SLOW_LIMIT, SLOW_LIMIT):
            for level in (0.0, 0.3, 1.0, 3.0, 10.0, 30.0):
                heat = {name: level * value for name, value in limit.items()}
                white, cost = _white_beside(lens, known, least, share, heat, slow_time, heat_time)
                if cost < lowest:
                    best, lowest = white, cost
    return Noise(outputs, tuple(float(w) for w in best), (), None, slow_time, heat_time)


def _white_beside(
    lens: Lens,
    known: NDArray[np.bool_],
    least: Array,
    share: float,
    heat: Mapping[str, float],
    slow_time: float,
    heat_time: float,
) -> tuple[Array, float]:
    """White level (Y,) of unit innovations beside given slow noise and heat, and its -log likelihood."""
    outputs = lens.fit.problem.outputs
    white = np.array(lens.fit.noise.white)
    cost = np.inf
    for _ in range(4):
        noise = Noise(outputs, tuple(white), tuple(share * white), heat, slow_time, heat_time)
        squares, counts, cost = np.zeros(len(outputs)), np.zeros(len(outputs)), 0.0
        for part, residual in zip(lens.filters, lens.residuals, strict=True):
            z, logdet = part.apply(noise, residual[:, :, None])
            innovation = np.full(residual.shape, np.nan)
            # single wrong readings do not count in full
            innovation[part.measured] = np.clip(z[:, 0], -4.0, 4.0)
            squares += np.nansum(innovation**2, axis=0)
            counts += part.measured.sum(axis=0)
            cost += logdet + 0.5 * float(np.nansum(innovation**2))
        factor = np.where(known, 1.0, np.sqrt(squares / np.maximum(counts, 1)))
        white = np.where(known, white, np.maximum(white * np.maximum(factor, 0.2), least))
        if np.all(np.abs(factor - 1) < 0.01):
            break
    return white, cost
