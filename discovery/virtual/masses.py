"""Where the insides of the bodies show: second masses that the baseline lacks in silence.

Each body of the plant is a bar of cells, and others join a stretch of it. What a lumped model lacks of that
is a hidden mass, but it does not only show where the cells are: the part of a housing around a ring moves
with the ring, and is a mass behind the ring. So it is measured which body a second mass helps at,

    q = G_m (lag(body, t_m) - body),

to first order in G_m, after a refit of everything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from discovery.models import Parameter
from discovery.terms import Term, parse
from discovery.virtual.log import Columns
from discovery.virtual.machine import Machine
from discovery.virtual.network import Array
from discovery.virtual.refit import Refit

TIMES = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
"""Time constants that are tried, as shares of a recording."""
_SIZE, _TIME = "G_m", "t_m"


def hidden_masses(machine: Machine, fitted: Refit, recordings: Mapping[str, Columns]) -> dict[str, float]:
    """The rms over noise that a second mass takes out of what a refit leaves, at the bodies where it takes
    out at least half as many squares as at the best of them.

    Args:
        fitted: the baseline fitted to these recordings.
        recordings: logs with noise-free readings of the machine without effect.
    """
    basis = np.linalg.qr(fitted.slopes / (np.linalg.norm(fitted.slopes, axis=0) + 1e-300))[0]

    def beyond(column: Array) -> Array:
        return np.asarray(column - basis @ (basis.T @ column))

    left = beyond(fitted.residual)
    found = {}
    for body in machine.baseline.states:
        signatures = (_signature(machine, fitted, recordings, body, share) for share in TIMES)
        found[body] = max(_taken(beyond(signature), left) for signature in signatures)
    most = max(found.values(), default=0.0)
    return {body: rms for body, rms in found.items() if rms > 0 and 2.0 * rms**2 >= most**2}


def _signature(
    machine: Machine, fitted: Refit, recordings: Mapping[str, Columns], body: str, share: float
) -> Array:
    """What a second mass of 1 W/K at a body changes of the readings (R,), over noise."""
    term = Term("second mass", body, parse(f"{_SIZE}*(lag({body}, {_TIME}) - {body})"))
    time = Parameter(share * machine.pace.hours * 3600.0, "s", 0.0, fixed=True)
    model = machine.baseline.with_terms(term, parameters={_SIZE: Parameter(0.0, "W/K", 0.0), _TIME: time})
    return fitted.slope(replace(machine, baseline=model), recordings)


def _taken(signature: Array, left: Array) -> float:
    """Rms that a positive size of a signature takes out of a residual."""
    along = float(signature @ left)
    length = float(np.linalg.norm(signature))
    return max(0.0, -along / length) / float(np.sqrt(len(left))) if length > 1e-9 else 0.0
