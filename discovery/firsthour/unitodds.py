"""Units of columns that name none: what loggers usually write, and which unit makes the values possible."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from discovery.firsthour.shapes import Shape

_ROOM, _ROOM_SD = 22.0, 6.0  # degC at which a machine starts
_AIR_SD = 8.0
# log odds of a unit of temperature, and what makes degC of it; kelvin fits no other values
_DEGREES = {
    "degC": (0.0, 1.0, 0.0),
    "degF": (-2.2, 5 / 9, -160 / 9),
    "K": (-0.5, 1.0, -273.15),
    "0.1 degC": (-0.5, 0.1, 0.0),
    "0.01 degC": (-1.5, 0.01, 0.0),
}
_ELSEWHERE = 0.01  # density per K of a machine that starts hot or cold
_USUAL_TRAVEL = (math.log(40.0), math.log(5.0))  # um of a thermal error: median, spread of the logarithm
_USUAL_HEAT = (math.log(800.0), math.log(6.0))  # W of a heat load at its most
_HALF = 0.5  # of its most: what a load reaches in most recordings
_USUAL_SPEED = (math.log(3000.0), math.log(5.0))  # rpm at its most


def temperature_odds(forms: Sequence[Shape], *, air: bool = False) -> dict[str, float]:
    """Log odds of the units of temperatures that share one. `air`: the air around a machine is never hot.

    Whole numbers may count in parts of a degree, as controllers do.
    """
    odds = {unit: prior for unit, (prior, _, _) in _DEGREES.items()}
    for form in forms:
        for unit, (_, factor, offset) in _DEGREES.items():
            first, low, high = (factor * v + offset for v in (form.first, form.low, form.high))
            if low < -60.0 or high > 1500.0 or (factor <= 0.1 and not form.whole):
                odds[unit] -= 12.0
                continue
            near = math.exp(-0.5 * ((first - _ROOM) / (_AIR_SD if air else _ROOM_SD)) ** 2) / (
                (_AIR_SD if air else _ROOM_SD) * math.sqrt(2 * math.pi)
            )
            far = _ELSEWHERE * (0.002 if air else 1.0)
            odds[unit] += math.log(factor * (0.75 * near + 0.25 * far))
    return odds


def error_odds(form: Shape, *, turns: bool) -> dict[str, float]:
    """Log odds of the units of a thermal error. `turns`: its name is that of an angle."""
    odds = {"um": 0.0, "mm": -0.7, "um/m": -4.0}
    for unit, size in (("um", 1.0), ("mm", 1000.0)):
        odds[unit] += _log_normal(max(form.span, 1e-12) * size, _USUAL_TRAVEL)
    odds["um/m"] += _log_normal(max(form.span, 1e-12), _USUAL_TRAVEL) + (8.0 if turns else 0.0)
    return odds


def load_odds(form: Shape, *, signal: bool) -> dict[str, float]:
    """Log odds of the units of a heat load. `signal`: what a controller sends to a heater."""
    if form.binary:
        return {"1": 8.0, "W": 0.0}
    odds = {"W": 0.0, "kW": -1.8, "percent": -1.0, "1": -3.0}
    top = max(abs(form.high), abs(form.low), 1e-9)
    if form.low >= 0.0 and _HALF < form.high <= 1.0:  # the share of what a heater can
        odds["1"] += 1.5 + (3.0 if form.high == 1.0 else 0.0)
    odds["W"] += _log_normal(top, _USUAL_HEAT)
    odds["kW"] += _log_normal(top * 1000.0, _USUAL_HEAT)
    if form.low >= -1e-9 and 10.0 < form.high <= 100.0:
        odds["percent"] += 2.5 + (1.0 if form.high == 100.0 else 0.0)
    else:
        odds["percent"] -= 4.0 if form.low < -1e-9 or form.high > 101.0 else 1.0
    if signal:
        odds["W"] -= 4.0
        odds["kW"] -= 4.0
        odds["1"] += 2.5
    return odds


def speed_odds(form: Shape) -> dict[str, float]:
    """Log odds of the units of a speed."""
    top = max(abs(form.high), abs(form.low), 1e-9)
    return {"rpm": _log_normal(top, _USUAL_SPEED), "1/s": -3.0 + _log_normal(60.0 * top, _USUAL_SPEED)}


def flow_odds(form: Shape) -> dict[str, float]:
    """Log odds of the units of a flow."""
    if form.binary:
        return {"1": 8.0, "l/min": 0.0}
    small = form.high <= 1.0
    return {
        "1": 0.5 if small else -3.0,
        "l/min": -0.2 if small else 1.0,
        "percent": 1.0 if 20 < form.high <= 100 else -5.0,
    }


def usual(role: str) -> Mapping[str, float]:
    """Units of the roles whose values say nothing of them."""
    return {"nozzle height": {"mm": 0.0}}.get(role, {"1": 0.0})


def _log_normal(value: float, about: tuple[float, float]) -> float:
    return -0.5 * ((math.log(value) - about[0]) / about[1]) ** 2
