"""A machine as a network of heat capacities, integrated in steps of 5 s."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]
Heat = Callable[[Array, int], Array]
STEP = 5.0  # s
BOLTZMANN, ZERO = 5.67e-8, 273.15  # W/(m^2 K^4), K


def kelvin4(T: Array | float) -> Array:
    """Fourth power of an absolute temperature [K^4], from degC."""
    return np.asarray((T + ZERO) ** 4)


@dataclass(frozen=True)
class Network:
    """Parts with a capacity [J/K], and links between two parts with a conductance [W/K]."""

    capacities: list[float] = field(default_factory=list)
    links: list[tuple[int, int, float]] = field(default_factory=list)

    def body(self, capacity: float, parts: int = 1, conductance: float = 0.0) -> slice:
        """Add a body: a chain of equal parts. Returns their places.

        Args:
            capacity: of the whole body [J/K].
            parts: number of parts in a row.
            conductance: from end to end of the body [W/K].
        """
        first = len(self.capacities)
        self.capacities.extend([capacity / parts] * parts)
        for i in range(first, first + parts - 1):
            self.links.append((i, i + 1, conductance * (parts - 1)))
        return slice(first, first + parts)

    def link(self, one: slice, i: int, two: slice, j: int, conductance: float) -> None:
        """Join part `i` of body `one` to part `j` of body `two` [W/K]."""
        self.links.append((one.start + i, two.start + j, conductance))

    def temperatures(self, count: int, start: float, heat: Heat) -> Array:
        """Temperatures (count, parts) [degC]. The links are exact; the heat is held during a step.

        Args:
            count: number of steps.
            start: temperature of all parts at first [degC].
            heat: heat flow into each part [W] from their temperatures [degC] and the number of the step.
        """
        size, capacity = len(self.capacities), np.array(self.capacities)
        rates = np.zeros((size, size))
        for i, j, conductance in self.links:
            rates[i, i] -= conductance
            rates[j, j] -= conductance
            rates[i, j] += conductance
            rates[j, i] += conductance
        both = np.zeros((2 * size, 2 * size))
        both[:size, :size] = rates / capacity[:, None] * STEP
        both[:size, size:] = np.diag(STEP / capacity)
        exact = expm(both)
        keep, gain = exact[:size, :size], exact[:size, size:]
        T, out = np.full(size, start, dtype=float), np.empty((count, size))
        for k in range(count):
            out[k] = T
            T = keep @ T + gain @ heat(T, k)
        return out
