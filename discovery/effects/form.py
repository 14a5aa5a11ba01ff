"""What the catalogue knows of an effect: a formula with holes for bodies and channels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Literal

Group = Literal["cutting fluid", "drive and cooling", "air and structure", "measuring chain", "user"]

# Where an effect can act. A word per rule of hypotheses.py; nothing is offered where it cannot act.
Place = Literal[
    "body",  # any body
    "fluid-free body",  # a body that the model leaves dry
    "wet body",  # a body that the model couples to the fluid
    "driven body",  # a body that receives drive losses: of a heat load, or by a law of the speed
    "speed-driven body",  # one that receives them by a law of the speed alone
    "air body",  # a body that the model couples to the air
    "pair",  # two bodies without a path between them in the model
    "any pair",  # two bodies, linked or not
    "link",  # two bodies that the model links
    "neighbour",  # a driven body and one that the model links to it; heat enters the driven one alone
    "fluid terms",  # every term in which the fluid temperature stands
    "cooling terms",  # every term in which the cooling power stands
    "seat",  # a body as all errors see it; the formula is added to its temperature there
    "output",  # one error, all recordings
    "output of a recording",  # one error in one recording
    "inputs of a recording",  # every input in one recording
    "recording",  # all errors of one recording
]

# Variables that a formula may use, and the role of the channel that stands for each
ROLE_OF = {
    "ambient": "ambient temperature",
    "fluid": "fluid temperature",
    "flow": "fluid flow",
    "speed": "rotation speed",
    "load": "heat load",
    "cooling": "cooling power",
    "coolant": "coolant temperature",
    "height": "nozzle height",
    "other_input": "other input",
}


@dataclass(frozen=True)
class Amplitude:
    """The number that switches the effect on: the formula is linear in it and zero at zero.

    `plausible` is the spread of sizes seen on machines of this class (one standard deviation), `sign` +1 or
    -1 where physics fixes it, 0 where it does not. `fixed`: the effect is on or off, its size sits in the
    shape parameters. `most` bounds a size that cannot be larger (a share), in magnitude.
    """

    name: str
    unit: str
    plausible: float
    sign: int = 1
    fixed: float | None = None
    most: float = inf


@dataclass(frozen=True)
class Shape:
    """A parameter inside the formula: a grid for the search, bounds for the refinement."""

    name: str
    unit: str
    grid: tuple[float, ...]
    low: float
    high: float
    fixed: bool = False  # searched on the grid alone


@dataclass(frozen=True)
class Example:
    """A worked example: values of the names in the formula, and what it gives (to four digits, `worked.py`).

    `before`: values of channels and bodies that held until they stepped to those in `values`, `since` seconds
    ago; it matters to formulas with memory alone. Without it everything is settled.
    """

    values: Mapping[str, float]
    expected: float
    before: Mapping[str, float] = field(default_factory=dict)
    since: float = inf


@dataclass(frozen=True)
class Effect:
    """One entry of the catalogue.

    `formula` is a heat flow [W] into `body` (and out of `other` where it names one), or what an output shows
    more. For "fluid terms" and "cooling terms" it is what their fluid, cooling or flow channel becomes (the
    first of these that it names); for outputs `y` is the error without the effect. Where states have no
    capacity (phenomenological models) it is a rate.
    """

    word: str
    title: str
    group: Group
    place: Place
    formula: str
    amplitude: Amplitude
    source: str
    signature: str
    confused_with: tuple[str, ...] = ()
    shapes: tuple[Shape, ...] = ()
    prior: float = 1.0  # weight against the other entries
    one_recording: bool = False  # its size belongs to one recording (an event, a fault)
    examples: tuple[Example, ...] = field(default=())

    @property
    def is_physics(self) -> bool:
        """False for faults of the measuring chain."""
        return self.group != "measuring chain"

    @property
    def at(self) -> str:
        """The speed that the amplitude is a size at, "1000 rpm", where the formula divides by one."""
        found = re.search(r"\bspeed\s*/\s*(\d+(?:\.\d+)?)", self.formula)
        return f"{float(found[1]):g} rpm" if found else ""
