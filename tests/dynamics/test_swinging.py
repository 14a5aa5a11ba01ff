"""Free runs of what swings many times: a mass on a spring that stiffens with the cube."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discovery.dynamics import make_grid, make_system, simulate
from discovery.errors import RunsAwayError
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

TIME = np.arange(0.0, 10.001, 0.01)
FORCE = np.where((TIME * 2).astype(int) % 2 == 0, 8.0, -4.0)


def spring(damping: float) -> Model:
    """Position and its rate."""
    states = {
        "x": State("x", "mm", None, parse("0"), 0.0, 1.0),
        "v": State("v", "mm/s", None, parse("0"), 0.0, 1.0),
    }
    terms = (Term("moves", "x", parse("v")), Term("turns", "v", parse("2000*F - 2400*x - 40*x**3 - d*v")))
    return Model("spring", {"d": Parameter(damping, "1/s")}, states, terms, {}, "s")


def test_many_swings_are_followed() -> None:
    channels = {
        "F": Channel("F", "other input", "N", None, "held"),
        "x": Channel("x", "other output", "mm", 0.01, "linear"),
    }
    recording = Recording("r", TIME, {"F": FORCE, "x": np.zeros(len(TIME))})
    grid = make_grid(Campaign("c", channels, {"r": recording}), "r", ["F"], ["x"])
    model = spring(12.0)
    found = simulate(make_system(model, grid), model.values(), np.zeros(2)).x[:, 0]
    exact, at = [0.0], np.zeros(2)
    for begin, end, force in zip(TIME[:-1], TIME[1:], FORCE[:-1], strict=True):

        def rate(_: float, s: np.ndarray, force: float = force) -> list[float]:
            return [s[1], 2000 * force - 2400 * s[0] - 40 * s[0] ** 3 - 12 * s[1]]

        at = solve_ivp(rate, (begin, end), at, rtol=1e-6, atol=1e-8).y[:, -1]
        exact.append(at[0])
    assert np.sqrt(np.mean((found - exact) ** 2)) < 0.1 * np.std(exact)

    pushed = spring(-12.0)  # swings grow, and the cube stiffens for ever
    with pytest.raises(RunsAwayError, match="diverges"):
        simulate(make_system(pushed, grid), pushed.values(), np.array([1e30, 0.0]))


def test_swings_that_grow_through_a_resonance_are_followed() -> None:
    """Newton's method on the whole trajectory does not settle here, nor on its halves."""
    time = np.arange(0.0, 60.001, 0.01)
    force = 8 * np.sin(2 * np.pi * (0.3 * time + 0.0183 * time**2))
    channels = {
        "F": Channel("F", "other input", "N", None, "held"),
        "x": Channel("x", "other output", "m", 0.01, "linear"),
    }
    recording = Recording("r", time, {"F": force, "x": np.zeros(len(time))})
    grid = make_grid(Campaign("c", channels, {"r": recording}), "r", ["F"], ["x"])
    states = {"x": State("x", "m", None, parse("0"), 0.0), "v": State("v", "m/s", None, parse("0"), 0.0)}
    terms = (Term("moves", "x", parse("v")), Term("turns", "v", parse("(F - 0.9*v - 45*x - 160*x**3)/1.2")))
    system = make_system(Model("spring", {}, states, terms, {}, "s"), grid)
    found = simulate(system, {}, np.zeros(2)).x[:, 0]

    at, exact = np.zeros(2), [0.0]
    for u in force[:-1]:
        for _ in range(10):  # Runge and Kutta in steps of 1 ms

            def rate(s: np.ndarray, u: float = u) -> np.ndarray:
                return np.array([s[1], (u - 0.9 * s[1] - 45 * s[0] - 160 * s[0] ** 3) / 1.2])

            a = rate(at)
            b = rate(at + 0.0005 * a)
            c = rate(at + 0.0005 * b)
            d = rate(at + 0.001 * c)
            at = at + 0.001 / 6 * (a + 2 * b + 2 * c + d)
        exact.append(at[0])
    assert np.sqrt(np.mean((found - exact) ** 2)) < 0.02 * np.std(exact)
