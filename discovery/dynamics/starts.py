"""Where the states of a system begin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics.system import System
from discovery.errors import RunsAwayError, UserError
from discovery.terms import names
from discovery.terms.dual import Value

Array = NDArray[np.float64]

_ROUNDS = 30  # of Newton on the balance
_CUT = 1e-10  # of the largest slope, below which a rate does not move with a state
_TOLERANCE = 1e-8  # largest change of a state in its unit, relative to 1 + its size


def start_values(
    system: System, values: Mapping[str, float], moved: Mapping[str, float] | None = None
) -> Array:
    """Start values (n,): an expression at the first instant, or the balance of the state's terms there.

    Args:
        moved: shifts of start values by name. States whose starts follow move along. Memories are settled
            anew, and shifted from there.
    """
    out = np.zeros(len(system.states))
    try:
        begun = system.starts({**system.grid.first, **values})
    except KeyError as missing:
        of = next(
            name for name, s in system.model.states.items() if s.start and missing.args[0] in names(s.start)
        )
        raise UserError(
            f"model '{system.model.name}': the start of state '{of}' needs {missing}, "
            f"which recording '{system.grid.recording}' does not give"
        ) from None
    for name, dual in begun.items():
        out[system.states.index(name)] = float(np.mean(dual.value))
    free = balanced(system)
    late = memories(system, free)
    if not moved or late != free:  # memories are settled once all others have moved
        out = _balanced(system, values, out, free)
    if moved:
        by = starts_follow(system) @ np.array([moved.get(name, 0.0) for name in system.states])
        out = _balanced(system, values, out + by, late)
        out[late] += by[late]
    return out


def at_rest(system: System, values: Mapping[str, float]) -> Array:
    """Where all states (n,) are in balance with the first inputs, those that are read, too."""
    return _balanced(system, values, start_values(system, values), list(range(len(system.states))))


def starts_follow(system: System) -> Array:
    """Shift of each start value (rows) when that of another state moves by one (columns), (n, n)."""
    found = np.eye(len(system.states))
    for i, state in enumerate(system.model.states.values()):
        for other, part in state.start_with.items():
            found[i] += part * found[system.states.index(other)]
    return found


def balanced(system: System) -> list[int]:
    """Indices of the states that start in the balance of their terms."""
    return [i for i, name in enumerate(system.states) if system.model.states[name].start is None]


def memories(system: System, free: Sequence[int]) -> list[int]:
    """The states among `free` that hold the memory of a lag()."""
    return [i for i in free if system.model.states[system.states[i]].memory]


def rates_at_start(
    system: System, values: Mapping[str, float], start: Array, wrt: Sequence[str], states: Sequence[int]
) -> tuple[Array, Array]:
    """Rates (S,) of some states at the first instant, and their derivatives (S, M) by the names of `wrt`."""
    rates, slopes = np.zeros(len(states)), np.zeros((len(states), len(wrt)))
    place = {i: k for k, i in enumerate(states)}
    into, source = system.into.tolist(), system.source.tolist()
    acting = tuple(
        t for t, ends in enumerate(zip(into, source, strict=True)) if not place.keys().isdisjoint(ends)
    )
    ends, memory = system.first
    env = {**ends, **values, **dict(zip(system.states, start.tolist(), strict=True))}
    column = {name: k for k, name in enumerate(wrt)}
    for t, dual in zip(acting, system.rates(env, frozenset(wrt), memory, acting), strict=True):
        partials = [(column[name], _first(partial)) for name, partial in dual.partials.items()]
        for state, sign in ((into[t], 1.0), (source[t], -1.0)):
            if state in place:
                factor = sign * system.scale[state]
                rates[place[state]] += factor * _first(dual.value)
                for name, partial in partials:
                    slopes[place[state], name] += factor * partial
    return rates, slopes


def settled(slopes: Array, rates: Array) -> Array:
    """Change (S, ...) that takes some rates (S, ...) away, given their slopes (S, S): a state whose rate does
    not move with it (the integral of its input) keeps its start.
    """
    own = np.diag(slopes)
    if np.count_nonzero(slopes) > np.count_nonzero(own):
        return np.asarray(np.linalg.lstsq(slopes, -rates, rcond=_CUT)[0])
    moves = np.abs(own) > _CUT * np.abs(own).max(initial=0.0)  # memories know nothing of each other
    inverse = np.where(moves, 1.0, 0.0) / np.where(moves, own, 1.0)
    return np.asarray(-(rates.T * inverse).T)


def _first(value: Value) -> float:
    """A number, or the first of a series."""
    return float(value[0] if isinstance(value, np.ndarray) and value.ndim else value)


def _balanced(system: System, values: Mapping[str, float], start: Array, free: Sequence[int]) -> Array:
    """The start values (n,) with some states in the balance of their terms, given the others."""
    wrt = [system.states[i] for i in free]
    before = 1.0
    for _ in range((1 if system.affine_in(tuple(wrt)) else _ROUNDS) if free else 0):
        rates, slopes = rates_at_start(system, values, start, wrt, free)
        if not (np.isfinite(rates).all() and np.isfinite(slopes).all()):
            raise RunsAwayError(
                f"model '{system.model.name}' has no finite rate at the start of recording "
                f"'{system.grid.recording}'; check its parameters and start values"
            )
        change = settled(slopes, rates)
        if not np.all(np.isfinite(change)):
            break
        start[free] += change
        size = np.max(np.abs(change)) / (1.0 + np.max(np.abs(start[free])))
        # the next step shrinks at least as much as this one did, and the first one to less than its square
        if size * min(1.0, size / before) < _TOLERANCE:
            break
        before = size
    return start
