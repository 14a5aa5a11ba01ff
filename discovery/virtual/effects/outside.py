"""What no catalogue holds: melting, heat of unknown cause, laws of an odd form."""

from __future__ import annotations

import numpy as np

from discovery.virtual.effects.effect import Effect, Place, Shapes, each, laws_at, minutes, power, stretch
from discovery.virtual.machine import Machine
from discovery.virtual.network import LEVEL, Array, Form, Inputs, Law
from discovery.virtual.signals import noise


def _bodies(m: Machine) -> list[Place]:
    return each(tuple(m.bodies))


def _melting(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Latent heat `size` [J] of something in the body that melts (wax, grease) within a degree or so."""
    name, tau = f"molten in {at[0]}", shapes("s", 300.0, 600.0, 1200.0)
    melt, smear = m.warm + shapes("K above room", 0.3, 1.0, 1.5), shapes("smear K", 0.2, 0.4, 0.6)
    nodes = stretch(m, at[0], shapes)
    laws = []
    for node, share in nodes:
        part = f"{name} {node}"
        laws.append(
            Law(
                "melting",
                Form.MELTING,
                part,
                node,
                1.0 / tau,
                shape=(melt, smear),
                leaves=node,
                take=size * share,
            )
        )
        laws.append(Law("melting", Form.LINK, part, size=1.0 / tau, leaves=node, take=size * share))
    return m.plus(laws, {f"{name} {node}": LEVEL for node, _ in nodes})


def _irregular(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Heat that comes and goes by its own clock, otherwise in every recording."""
    tau, seed = (
        shapes("s", minutes(m, 120.0), minutes(m, 200.0), minutes(m, 300.0)),
        int(shapes("seed", 0, 1, 2**31)),
    )

    def gate(u: Inputs) -> Array:
        own = np.random.default_rng([seed, int(u["number"][0])])
        return np.asarray(0.5 * (1 + np.tanh(3 * noise(own, len(u["clock"]), m.pace.step_s, tau, 1.0))))

    return m.plus(laws_at("irregular", Form.HEAT, stretch(m, at[0], shapes), size, gate))


def _odd(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The right input in a wrong form: a resonance in speed, or a rhythm of its own while something is on."""
    input_ = (
        m.words.speed if m.words.speed and shapes("form", 0, 0, 1) < 0.5 else m.words.pump or m.words.power
    )
    if input_ == m.words.speed:
        centre, width = shapes("n/top", 0.3, 0.5, 0.7), shapes("width", 0.05, 0.08, 0.12)

        def gate(u: Inputs) -> Array:
            x = u[input_] / m.words.top_speed
            return np.asarray((x > 0) * np.exp(-(((x - centre) / width) ** 2)))
    else:
        period, phase = (
            shapes("period s", minutes(m, 300.0), minutes(m, 400.0), minutes(m, 660.0)),
            shapes("phase", 0, 1, 6.28),
        )

        def gate(u: Inputs) -> Array:
            on = u[input_] > 0.2 * u[input_].max()
            return np.asarray(on * np.sin(2 * np.pi * u["clock"] / period + phase))

    return m.plus(laws_at("odd", Form.HEAT, stretch(m, at[0], shapes), size, gate))


def _latent(m: Machine, at: Place) -> float:
    return 8.0 * m.bodies[at[0]].capacity


def _odd_places(m: Machine) -> list[Place]:
    return _bodies(m) if m.words.speed or m.words.pump or m.words.power else []


OUTSIDE = (
    Effect(
        "out of catalogue",
        "J",
        "latent heat of something that melts",
        _bodies,
        _latent,
        _melting,
        (),
        ("unexplained",),
    ),
    Effect(
        "out of catalogue", "W", "a law of an odd form", _odd_places, power(2.0), _odd, (), ("unexplained",)
    ),
    Effect(
        "unmeasured_heat",
        "W",
        "heat by its own clock",
        _bodies,
        power(2.0),
        _irregular,
        ("swarf_heat",),
        ("unexplained",),
    ),
)
