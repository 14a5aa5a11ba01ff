"""A hypothesis: one effect of the catalogue at one place in a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from discovery.mismatch.catalogue.effect import Effect
from discovery.models import Model, Parameter
from discovery.terms import Apply, Expression, Name, Term, names, substitute

BEFORE = Name("what the output showed before")  # no channel has such a name


@dataclass(frozen=True)
class Hypothesis:
    """An effect at a place with its shape parameters at given values.

    `terms` enter states; `shown` is what outputs show in addition, in terms of what they showed before
    (`BEFORE`), or by how much they see the body of `states` moved. Both hold the amplitudes and shapes as
    parameters.
    """

    effect: Effect
    states: tuple[str, ...]
    amplitudes: tuple[str, ...]
    terms: tuple[Term, ...] = ()
    shown: Mapping[str, Expression] = field(default_factory=dict)
    output: str | None = None
    recording: str | None = None
    shapes: Mapping[str, float] = field(default_factory=dict)  # parameter name -> value
    channels: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)  # parameter name -> unit at this place
    cost: float = 0.0  # log of the number of instants that were searched for it
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # 95 % range of such an instant

    @property
    def key(self) -> tuple[str, tuple[str, ...], str | None, str | None, tuple[str, ...]]:
        """What the hypothesis claims, whatever its shape values."""
        return (self.effect.word, self.states, self.output, self.recording, self.channels)

    @property
    def places(self) -> tuple[str, ...]:
        """States, or outputs for what happens in the measuring chain."""
        return self.states or ((self.output,) if self.output else tuple(self.shown))

    @property
    def where(self) -> str:
        """The places, or the recording of what concerns all of it."""
        return ", ".join(self.places) or self.recording or "all recordings"

    @property
    def shifts_the_zero(self) -> bool:
        """Whether outputs are shifted by something that does not depend on what they showed before."""
        return any(BEFORE.id not in names(change) for change in self.shown.values()) and not self.states

    def at(self, shapes: Mapping[str, float]) -> Hypothesis:
        """The same claim with other shape values."""
        return replace(self, shapes={**self.shapes, **shapes})

    def added_to(self, model: Model, start: Mapping[str, float] | None = None) -> Model:
        """The model with the effect, its amplitudes starting at `start` (default: a tenth of plausible)."""
        start = start or {}
        amplitude = self.effect.amplitude
        parameters = {}
        for name in self.amplitudes:
            low = 0.0 if amplitude.sign > 0 else -amplitude.most
            high = 0.0 if amplitude.sign < 0 else amplitude.most
            value = start.get(
                name,
                amplitude.fixed
                if amplitude.fixed is not None
                else 0.1 * amplitude.plausible * (amplitude.sign or 1),
            )
            parameters[name] = self._parameter(name, value, low, high, amplitude.fixed is not None)
        for (name, value), shape in zip(self.shapes.items(), self.effect.shapes, strict=True):
            parameters[name] = self._parameter(
                name, start.get(name, value), shape.low, shape.high, shape.fixed
            )
        outputs = {
            name: Apply("+", (model.outputs.get(name, Name(name)), extra))
            for name, extra in self.shows(model).items()
        }
        return model.with_terms(*self.terms, parameters=parameters, outputs=outputs)

    def shows(self, model: Model) -> dict[str, Expression]:
        """What outputs show in addition where the effect comes to a model: whatever else that one has."""
        found: dict[str, Expression] = {}
        for name, change in self.shown.items():
            y = model.outputs.get(name, Name(name))
            if self.states:
                moved = Apply("+", (Name(self.states[0]), change))
                found[name] = Apply("-", (substitute(y, {self.states[0]: moved}), y))
            else:
                found[name] = substitute(change, {BEFORE.id: y})
        return found

    def _parameter(self, name: str, value: float, low: float, high: float, fixed: bool) -> Parameter:
        unit = self.units.get(name, "1")
        if self.recording is None:
            return Parameter(value, unit, low, high, fixed)
        # An event of one recording: the common value 0 keeps it out of every other one.
        return Parameter(
            0.0, unit, min(low, 0.0), max(high, 0.0), fixed, True, values={self.recording: value}
        )
