"""How long the effect of a start lasts: three times the slowest time constant of a model.

A time constant is that of a mode of the model, linearised at the balance under the middle of its trained
inputs. After three of them a twentieth of a wrong start is left. A mode that no output shows does not count.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.compiled import compile_model
from discovery.export.document import Exported
from discovery.export.guarding import Times, compensated, without_offsets
from discovery.export.stepper import Stepper

Array = NDArray[np.float64]

TIMES = 3.0  # time constants until a start has settled
_LONGEST_S = 30 * 24 * 3600.0  # slower modes are held to be constant
_STEP_S = 600.0  # to the balance: the step is exact for linear terms, whatever their size
_UNSEEN = 1e-9  # share of the most visible mode, below which outputs do not show a mode


def slowest_s(exported: Exported) -> float | None:
    """Slowest time constant [s] of what the outputs show; 0 without states, None where it cannot be found."""
    middle = np.array([0.5 * (i.range.low + i.range.high) for i in exported.inputs])
    stepper = Stepper(compile_model(exported.model, _STEP_S))
    if not len(stepper.x):
        return 0.0
    try:
        stepper.start(middle)
    except UserError:
        return None
    stepper.run(np.tile(middle, (round(_LONGEST_S / _STEP_S), 1)))
    rates, shape = np.linalg.eig(stepper.jacobian(middle))
    shown = np.abs(_slopes(stepper, middle) @ shape).max(axis=0, initial=0.0)
    seen = (shown > _UNSEEN * shown.max(initial=0.0)) & (rates.real < -1.0 / _LONGEST_S)
    return float(-1.0 / rates.real[seen].max()) if seen.any() else 0.0


def beginning(exported: Exported) -> list[str]:
    """What a user has to know before a compensation starts cold: how long it takes, and how far an offset
    moves in a tick.
    """
    if lines := without_offsets(exported.outputs):
        return lines
    slowest, step = slowest_s(exported), exported.compiled.step_s
    if slowest:
        lines.append(
            f"a cold start settles after about {duration(TIMES * slowest)}, because the slowest time "
            f"constant is {duration(slowest)}; the state is COLD for {duration(Times.settle_s)}; no wait is "
            "needed after a saved state (compensate --state FOLDER; in C, copy the struct), or if the "
            "machine has stood still for so long before the start"
        )
    most = ", ".join(
        f"{step * output.range.rate:.2g} {output.unit} ({output.name})"
        for output in (exported.outputs[k] for k in compensated(exported))
    )
    return [*lines, f"in a tick of {step:g} s an offset moves by at most {most}"]


def duration(seconds: float) -> str:
    """A time with two digits.

    >>> duration(28800.0), duration(5400.0), duration(40.0)
    ('8 h', '1.5 h', '40 s')
    """
    size, unit = (3600.0, "h") if seconds >= 3600 else (60.0, "min") if seconds >= 60 else (1.0, "s")
    return f"{float(f'{seconds / size:.2g}'):g} {unit}"


def _slopes(stepper: Stepper, u: Array) -> Array:
    """Slopes (Y, n) of the outputs in the states, by central differences."""
    x, columns = stepper.x.copy(), []
    for k in range(len(x)):
        ends = []
        for way in (0.01, -0.01):
            stepper.x[:] = x
            stepper.x[k] += way
            ends.append(stepper.outputs(u))
        columns.append((ends[0] - ends[1]) / 0.02)
    stepper.x[:] = x
    return np.array(columns).T
