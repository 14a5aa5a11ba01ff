"""What no catalogue holds: heat of unknown cause, melting, laws of another form, an odd joint."""

from __future__ import annotations

import numpy as np

from discovery.virtual import chains
from discovery.virtual.cycles import noise
from discovery.virtual.fine import BODIES, STEP_S, Array, FineMachine, Inputs
from discovery.virtual.laws import Concealed, Draw, Maker, always, body_law, one_of


def window_of_heat(rng: Draw, n: int) -> tuple[Array, float, float]:
    """A window (n,) with soft edges of a few minutes, 3 to 10 h long, and its start and end [s]."""
    length = rng.uniform(3, 10) * 3600
    start = rng.uniform(0.05, 0.95) * (n * STEP_S - length)
    t, edge = (np.arange(n) + 0.5) * STEP_S, rng.uniform(60, 400)
    shape = (np.tanh((t - start) / edge) - np.tanh((t - start - length) / edge)) / 2
    return np.asarray(shape), round(float(start)), round(float(start + length))


def phase_change(rng: Draw, _: FineMachine) -> Concealed:
    """Latent heat of something that melts in a body (wax, grease), smeared over temperature and time."""
    b, melt = one_of(rng, (0, 1, 2, 3)), rng.uniform(23.5, 25.5)
    shape = (melt, rng.uniform(300, 1200), rng.uniform(0.2, 0.6))
    law = body_law(chains.MELTING, b, always, shape=shape)
    return Concealed("out of catalogue", (BODIES[b],), law, "J", 50e3, 600e3, accepts=("unexplained",))


def irregular_heat(rng: Draw, _: FineMachine) -> Concealed:
    """Heat that comes and goes by its own clock, otherwise in every recording."""
    b, tau, seed = one_of(rng, (0, 1, 2, 3, 4)), rng.uniform(2, 5) * 3600, int(rng.integers(2**31))

    def gate(u: Inputs) -> Array:
        own = np.random.default_rng([seed, int(u.air[0] * 1e6)])
        return np.asarray(0.5 * (1 + np.tanh(3 * noise(own, len(u.air), STEP_S, tau, 1.0))))

    law = body_law(chains.HEAT, b, gate)
    return Concealed("unmeasured_heat", (BODIES[b],), law, "W", 60.0, 300.0, accepts=("unexplained",))


def shifted_law(rng: Draw, _: FineMachine) -> Concealed:
    """The right input in a wrong form: a resonance in speed, or a rhythm of its own while the pump runs."""
    b = one_of(rng, (1, 2, 3))
    centre, width = rng.uniform(350, 800), rng.uniform(60, 140)
    phase, period = rng.uniform(0, 6.28), rng.uniform(5, 11) * 3600

    def resonance(u: Inputs) -> Array:
        return np.asarray(np.exp(-(((u.speed - centre) / width) ** 2)))

    def rhythm(u: Inputs) -> Array:
        return np.asarray(u.pump * np.sin(2 * np.pi * np.arange(len(u.pump)) * STEP_S / period + phase))

    law = body_law(chains.HEAT, b, resonance if rng.uniform() < 0.5 else rhythm)
    return Concealed("out of catalogue", (BODIES[b],), law, "W", 60.0, 300.0, accepts=("unexplained",))


OUTSIDE: tuple[Maker, ...] = (phase_change, irregular_heat, shifted_law)


def odd_joint(x: Array, width: float, creep: float) -> Array:
    """A joint of unusual shape: play 0.4 as wide on the way up, and it creeps home by `creep` a minute."""
    y, now, share = np.empty_like(x), float(x[0]), creep * STEP_S / 60.0
    for k, value in enumerate(x.tolist()):
        now = max(value - width, min(value + 0.4 * width, now))
        now += share * (value - now)
        y[k] = now
    return y
