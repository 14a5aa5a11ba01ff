"""What a channel can be: the words of the campaign file, their units, and what values are possible."""

from dataclasses import dataclass, field
from typing import Literal

Between = Literal["held", "linear"]
Role = Literal[
    "ambient temperature",
    "fluid temperature",
    "fluid flow",
    "rotation speed",
    "heat load",
    "cooling power",
    "coolant temperature",
    "nozzle height",
    "nozzle side",
    "temperature",
    "error",
    "applied correction",
    "other input",
    "other output",
]
CORRECTION: Role = "applied correction"
SENSORS: tuple[Role, ...] = (
    "ambient temperature",
    "fluid temperature",
    "coolant temperature",
    "temperature",
    "error",
)


@dataclass(frozen=True)
class Range:
    """Values in a canonical unit: outside `possible` something is wrong, outside `usual` worth a look."""

    usual: tuple[float, float]
    possible: tuple[float, float] = (float("-inf"), float("inf"))


@dataclass(frozen=True)
class RoleFacts:
    """`units`: canonical, one a dimension; none: any unit, kept as given. `ranges`: by canonical unit."""

    units: tuple[str, ...]
    between: Between = "held"
    ranges: dict[str, Range] = field(default_factory=dict)
    measured: bool = False  # an output: read now and then, never interpolated
    plain: bool = False  # a dimensionless value is kept as given (a heater in percent)
    open: bool = False  # a value of another dimension is kept as given (an error in V)

    @property
    def said(self) -> str:
        """The units that its channels can have, in words."""
        return " or ".join((*self.units, *(("percent",) if self.plain else ()))) or "any unit"


def _temperature(low: float, high: float, *, measured: bool = False) -> RoleFacts:
    return RoleFacts(("degC",), between="linear", ranges=_degrees(low, high), measured=measured)


def _degrees(low: float, high: float) -> dict[str, Range]:
    return {"degC": Range((low, high), (-273.15, 2000.0))}


_DEVIATION = dict.fromkeys(("um", "um/m"), Range((-1e4, 1e4)))
_CORRECTION = dict.fromkeys(("um", "um/m"), Range((-2000.0, 2000.0)))
FLOWS = ("l/min", "kg/min")  # volume or mass, about the same number for water
_FLOW = Range((0.0, 1e5), (0.0, 1e6))  # up to the air of a hall
_POWER = {"W": Range((-1e6, 1e7)), "percent": Range((-100.0, 100.0))}

ROLES: dict[str, RoleFacts] = {
    "ambient temperature": _temperature(-30.0, 60.0),
    "fluid temperature": _temperature(-10.0, 90.0),
    "coolant temperature": _temperature(-30.0, 90.0),
    "temperature": _temperature(-50.0, 300.0, measured=True),
    "fluid flow": RoleFacts(
        ("1", *FLOWS), ranges={"1": Range((0.0, 1.0), (0.0, 1e6)), **dict.fromkeys(FLOWS, _FLOW)}
    ),
    "rotation speed": RoleFacts(("rpm",), ranges={"rpm": Range((-30e3, 30e3), (-1e6, 1e6))}),
    "heat load": RoleFacts(("W",), ranges=_POWER, plain=True),
    "cooling power": RoleFacts(("W",), ranges=_POWER, plain=True),
    "nozzle height": RoleFacts(("mm",), ranges={"mm": Range((0.0, 2000.0))}),
    "nozzle side": RoleFacts(("1",), ranges={"1": Range((-2.0, 2.0))}),
    "error": RoleFacts(("um", "um/m"), ranges=_DEVIATION, measured=True, open=True),
    CORRECTION: RoleFacts(("um", "um/m"), ranges=_CORRECTION),
    "other input": RoleFacts((), ranges=_degrees(-50.0, 300.0)),
    "other output": RoleFacts((), between="linear", measured=True),
}


def is_input(role: str) -> bool:
    """Whether models are fed with channels of a role: neither read and compared, nor added to readings."""
    return not ROLES[role].measured and role != CORRECTION
