"""An effect in the catalogue: a formula with variables for bodies and channels, and its search."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import ceil, erf, exp, inf, log, log10, pi, sqrt
from typing import Literal

Group = Literal[
    "cutting fluid", "drive and cooling", "air and structure", "inputs", "measuring chain", "user"
]

Acts = Literal["always", "in one recording", "from a recording on", "as parts age"]

# Where an effect can act. A word per rule of `places.py`; nothing is offered where it cannot act.
Place = Literal[
    "body",  # any body
    "fluid-free body",  # a body that the model leaves dry
    "wet body",  # a body that the model couples to the fluid
    "driven body",  # a body that receives drive losses: of a heat load, or by a law of the speed
    "air body",  # a body that the model couples to the air
    "pair",  # two bodies without a path between them in the model
    "any pair",  # two bodies, linked or not
    "link",  # two bodies that the model links
    "driven and another",  # a driven body and any other one; heat enters the driven one alone
    "fluid terms",  # terms in which the fluid temperature stands
    "coolant terms",  # terms in which the coolant temperature stands
    "cooling terms",  # terms in which the cooling power stands
    "current terms",  # terms in which an electric current stands
    "loss terms",  # at each body laws of the speed, or else terms of a heat load or another input
    "loss terms and a neighbour",  # the loss terms that enter one body, and a body that is linked to it
    "air terms",  # terms in which the ambient temperature stands
    "heat of a body",  # the loss terms that enter one body
    "error state",  # a state that is an error: its terms are rates
    "seat",  # a body as all errors see it; the formula is added to its temperature there
    "lever",  # a body; each error sees the formula with a lever of its own
    "thermometer",  # a body as one measured temperature sees it
    "output",  # one output, all recordings
    "output of a state",  # the same, of a state of the model: where none is, the body itself lags
    "output that is no temperature",  # the same; what a thermometer shows beyond the model is heat
    "output of errors",  # the same, of a model whose states are errors
    "output of a recording",  # one error in one recording
    "output next to others",  # one output of several
    "output that is a temperature",  # where an error would count from a zero of its own
    "input temperature",  # one recorded temperature, wherever the model uses it
    "driving input",  # one recorded input that is no temperature, wherever the model uses it
    "inputs of a recording",  # every input in one recording
    "recording",  # all errors of one recording, which a device shows: no thermometer is set to zero
]
TERM_PLACES = (
    "fluid terms",
    "coolant terms",
    "cooling terms",
    "current terms",
    "loss terms",
    "loss terms and a neighbour",
    "heat of a body",
    "air terms",
    "input temperature",
    "driving input",
)

OF_INPUTS = ("input temperature", "driving input", "inputs of a recording")  # which are replaced themselves

# what a formula without `term` replaces in the terms of its place: the first of these that it names
REPLACED = ("fluid", "coolant", "ambient", "cooling", "load", "flow")

# Variables that a formula may use, and the role of the channel that each is
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
# Variables that may be any recorded input: its value, or its share of the largest recorded value;
# `rate` is such a level of a flow
INPUT, LEVEL, RATE = "input", "level", "rate"
TERM = "term"  # the term of the model that an effect changes
DRIVING = (  # roles of the inputs that an error may follow by a law of its own
    "heat load",
    "cooling power",
    "rotation speed",
    "fluid flow",
    "nozzle height",
    "nozzle side",
    "other input",
)

ALL = 1.25  # the most of a share: all of it, and as much more as the flow that it is a share of may be off

_PER_SPEED = r"(\bspeed\s*/\s*)(\d+(?:\.\d+)?)"  # at which speed the size of an effect counts
_REACH = 2.0  # standard deviations of a prior that a search covers
FARTHEST = 4.0  # ... and beyond which a law is another one, and a reading is wrong
_SHIFTED = 1 / 8  # of the longest recording: usual shifts in time are no longer, however slow a machine is
_HALVES = 6  # cells on either side of zero, each half as wide as the next: down to a thirtieth of the spread


def _around_zero() -> tuple[tuple[float, float], ...]:
    """Values of a normal of either sign, and the weight of each: the means of cells that become smaller
    towards zero. An effect without a size (a clock that is wrong) is as small as its shape.
    """
    edges = [_REACH * 0.5**k for k in range(_HALVES)]
    cells = [*((low, high) for high, low in pairwise(edges)), (0.0, edges[-1])]
    mass = [(erf(high / sqrt(2)) - erf(low / sqrt(2))) / 2 for low, high in cells]
    moment = [(exp(-0.5 * low**2) - exp(-0.5 * high**2)) / sqrt(2 * pi) for low, high in cells]
    total = 2 * sum(mass)
    pairs = [(m / w, w / total) for m, w in zip(moment, mass, strict=True)]
    return (*((-z, w) for z, w in pairs), *((z, w) for z, w in reversed(pairs)))


_AROUND_ZERO = _around_zero()


@dataclass(frozen=True)
class Amplitude:
    """The number that switches the effect on: the formula is linear in it and zero at zero.

    `plausible` is a usual size on machines of this class, `sign` +1 or -1 where physics fixes it, 0 where it
    does not. `fixed`: the effect is on or off, its size sits in the shape parameters. `most` bounds a size
    that cannot be larger (a share), in magnitude.
    """

    name: str
    unit: str
    plausible: float
    sign: int = 1
    fixed: float | None = None
    most: float = inf

    @property
    def ends(self) -> tuple[float, float]:
        """Between which a size stays."""
        return 0.0 if self.sign > 0 else -self.most, 0.0 if self.sign < 0 else self.most


@dataclass(frozen=True)
class Shape:
    """A parameter inside the formula, with its prior: the same in a search, where it is integrated over a few
    values, and in a refit.

    With `factor`: 68 % of values lie within this factor of `middle` (log-normal). With `spread`: normal
    around `middle`. Without a `middle` any time constant that the recordings can show is as likely as any
    other on a logarithmic scale. `instant`: a time in the recording, which is searched for by itself.
    `apart`: ratio of neighbouring values in a search, whose signatures are much alike; those of a delay,
    which smooths nothing, are so only close by. `is_shift`: by how much something comes late, which a
    recording shows only if it is far longer. `or_at_once`: the shortest value stands for none at all.
    """

    name: str
    unit: str
    middle: float | None
    factor: float = 0.0
    spread: float = 0.0
    instant: bool = False
    least: float = 0.0  # what the recordings can show of a time constant, ...
    most: float = inf  # ... beyond which it looks like a drift
    apart: float = 3.0
    is_shift: bool = False
    or_at_once: bool = False

    def within(self, shortest: float, longest: float) -> Shape:
        """The shape for recordings that show time constants from `shortest` to `longest` [s]."""
        if self.middle is not None:
            if self.unit == "s" and self.spread > 0:
                return replace(self, spread=min(self.spread, _SHIFTED * longest))
            return replace(self, middle=min(self.middle, _SHIFTED * longest)) if self.is_shift else self
        middle, factor = sqrt(shortest * longest), (longest / shortest) ** (0.5 / _REACH)
        least, most = (middle * factor**z for z in (-_REACH, _REACH))
        return replace(self, middle=middle, factor=factor, least=least, most=most)

    @property
    def values(self) -> tuple[tuple[float, float], ...]:
        """Values to integrate over, and the logarithm of the weight of each."""
        if self.instant or self.middle is None:
            return ((self.middle or 0.0, 0.0),)
        if not self.factor:
            return tuple((self.middle + self.spread * z, log(w)) for z, w in _AROUND_ZERO)
        count = max(3, ceil(2 * _REACH * log(self.factor) / log(self.apart)) + 1)
        steps = [-_REACH + 2 * _REACH * k / (count - 1) for k in range(count)]
        weights = [exp(-0.5 * z * z) for z in steps]
        total = log(sum(weights))
        return tuple(
            (self.middle * self.factor**z, log(w) - total) for z, w in zip(steps, weights, strict=True)
        )

    @property
    def ends(self) -> tuple[float, float]:
        """What the value may be at all: a law whose exponent lies far outside its range is another law."""
        if self.middle is None or self.instant:
            return 0.0, inf
        if not self.factor:
            return self.middle - FARTHEST * self.spread, self.middle + FARTHEST * self.spread
        lowest, highest = (self.middle * self.factor**z for z in (-FARTHEST, FARTHEST))
        return max(self.least, lowest), min(self.most, highest)


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
    more; where `term` stands in it, it is what a term of the model changes by, and at other "terms" what
    their channel becomes (the first of `REPLACED` that it names). For outputs `y` is the error without the
    effect. Where states have no capacity (phenomenological models) it is a rate.

    `search`: how its instants are found, if it has any; `acts`: in all recordings, in one, from one on, or as
    parts age: from one on, or in each recording after the first one by as much more.
    `shared`: also offered at all its places at once, with one size. `spreads`: also offered at two linked
    bodies at once, with a size at each. `roles`: of the recorded inputs that its formula may follow, and
    `inputs_in` a unit of theirs, where it needs one; `unless`: of a recorded input that would say that it
    acts, so that it is not offered where one moves.
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
    search: Literal["shapes", "window", "step", "single readings"] = "shapes"
    acts: Acts = "always"
    shared: bool = False
    spreads: bool = False
    roles: tuple[str, ...] = ()
    inputs_in: str = ""
    unless: tuple[str, ...] = ()
    examples: tuple[Example, ...] = field(default=())

    @property
    def is_physics(self) -> bool:
        """False for faults of the measuring chain."""
        return self.group != "measuring chain"

    @property
    def is_event(self) -> bool:
        """Whether it belongs to one recording: it does not act in any other."""
        return self.acts == "in one recording"

    @property
    def lasts(self) -> bool:
        """Whether it stays once it has begun."""
        return self.acts in ("from a recording on", "as parts age")

    @property
    def is_law(self) -> bool:
        """Whether it acts in the machine whenever it may: no event, and no fault of the measuring chain."""
        return self.is_physics and not self.is_event

    @property
    def at(self) -> str:
        """The speed that the amplitude is a size at, "1000 rpm", where the formula divides by one; of what a
        speed adds to, it is the size at standstill.
        """
        found = re.search(_PER_SPEED, self.formula)
        if re.search(r"\+[^()]*\bspeed\b", self.formula):
            return ""
        return f"{float(found[2]):g} rpm" if found else ""

    def up_to(self, speed: float) -> Effect:
        """The effect on a machine that turns at most at a speed [rpm]. On a slow one, its size counts at the
        nearest power of ten: a roll at 20 rpm rubs as much as a spindle at 1000 rpm.
        """
        if not self.at or speed <= 0:
            return self

        def slower(found: re.Match[str]) -> str:
            return f"{found[1]}{min(float(found[2]), 10.0 ** round(log10(speed))):.10g}"

        return replace(self, formula=re.sub(_PER_SPEED, slower, self.formula))
