"""A hypothesis: one effect of the catalogue at one place in a model."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from math import inf, log

from discovery.effects.form import Effect
from discovery.models import Model, Parameter
from discovery.printed import when
from discovery.terms import Apply, Expression, Name, Term, names, substitute

BEFORE = Name("what the output showed before")  # no channel has such a name
Key = tuple[str, tuple[str, ...], tuple[str, ...], str | None, bool, tuple[str, ...]]


@dataclass(frozen=True)
class Hypothesis:
    """An effect at a place with its shape parameters at given values.

    `terms` enter states; `shown` is what outputs show in addition, in terms of what they showed before
    (`BEFORE`), or by how much they see the body of `states` moved. Both hold the amplitudes and shapes as
    parameters. `recording`: the one in which it acts, or begins to act; `switch` is then the parameter that
    is one in the recordings of `acting` (1, 2, 3 ... if it grows) and zero in others.
    """

    effect: Effect
    states: tuple[str, ...]
    amplitudes: tuple[str, ...]
    terms: tuple[Term, ...] = ()
    shown: Mapping[str, Expression] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    recording: str | None = None
    acting: tuple[str, ...] = ()
    switch: str = ""
    grows: bool = False
    shapes: Mapping[str, float] = field(default_factory=dict)  # parameter name -> value
    channels: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)  # parameter name -> unit at this place
    log_odds: float = 0.0  # prior log odds that it acts at this place
    log_weight: float = 0.0  # ... of its shape values among all of them
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # 95 % range of an instant

    @property
    def key(self) -> Key:
        """What the hypothesis claims, whatever its shape values."""
        return self.effect.word, self.states, self.outputs, self.recording, self.grows, self.channels

    @property
    def places(self) -> tuple[str, ...]:
        """States, or outputs or channels for what happens in the measuring chain."""
        return self.states or self.outputs or self.channels

    @property
    def where(self) -> str:
        """The places, with the inputs that it follows, or the recording of what concerns all of it."""
        follows = f" from {', '.join(self.follows)}" if self.follows else ""
        return (", ".join(self.places) or self.recording or "all recordings") + follows

    @property
    def stated(self) -> str:
        """The effect, where it acts, and the recording of an event."""
        run = {"recording": self.recording, "lasts": self.effect.lasts, "grows": self.grows}
        event = f" {when(run)}" if self.recording and self.places else ""
        return f"{self.effect.word} at {self.where}{event}"

    @property
    def event(self) -> str | None:
        """The recording that it is a claim of; None for what ages: whether at once or from recording to
        recording, and from which one on, is no other claim.
        """
        return None if self.effect.acts == "as parts age" else self.recording

    @property
    def claim(self) -> tuple[str, str, str | None]:
        """What is claimed: the effect, where it acts, and the recording of an event."""
        return self.effect.word, self.where, self.event

    @property
    def follows(self) -> tuple[str, ...]:
        """Inputs that it follows, of an effect that may follow any of some roles; one that is its place is
        none of them.
        """
        return tuple(n for n in self.channels if n not in self.places) if self.effect.roles else ()

    @property
    def instants(self) -> tuple[str, ...]:
        """Names of its shapes that are times in the recording."""
        pairs = zip(self.shapes, self.effect.shapes, strict=True)
        return tuple(name for name, shape in pairs if shape.instant)

    @property
    def law(self) -> tuple[object, ...]:
        """What acts, and where, in whatever recordings."""
        return self.effect.word, self.effect.formula, self.states, self.outputs, self.channels

    @property
    def shifts_the_zero(self) -> bool:
        """Whether outputs are shifted by something that does not depend on what they showed before."""
        return any(BEFORE.id not in names(change) for change in self.shown.values()) and not self.states

    def widens(self, other: Hypothesis) -> bool:
        """Whether it is the same law at the bodies of another one and more."""
        same = (self.effect, self.recording, self.channels) == (other.effect, other.recording, other.channels)
        return same and set(self.states) > set(other.states)

    def without(self, bodies: Collection[str]) -> Hypothesis | None:
        """The same law, of one size, at its bodies except some; None where fewer than two are left, or where
        it is no law at each of several bodies.
        """
        left = tuple(b for b in self.states if b not in bodies)
        of_each = tuple(t.into for t in self.terms if not t.source)
        if len(left) < 2 or len(self.amplitudes) > 1 or len(of_each) < len(self.terms):
            return None
        if set(of_each) != set(self.states):
            return None
        terms = tuple(t for t in self.terms if t.into in left)
        # any other choice of bodies was as likely before
        return replace(self, states=left, terms=terms, log_odds=self.log_odds - log(len(self.states)))

    def acts_in(self, recording: str) -> bool:
        """Whether it acts in a recording."""
        return self.recording is None or recording in self.acting

    def share(self, recording: str) -> float:
        """How much of it acts in a recording: all or nothing, or one step more in each that follows."""
        if not self.grows or not self.acts_in(recording):
            return float(self.acts_in(recording))
        return 1.0 + self.acting.index(recording)

    def at(self, shapes: Mapping[str, float], log_weight: float = 0.0) -> Hypothesis:
        """The same claim with other shape values."""
        return replace(self, shapes={**self.shapes, **shapes}, log_weight=log_weight)

    def values(self, recording: str, size: float = 1.0) -> dict[str, float]:
        """Its parameters in a recording, with amplitudes of a size."""
        switch = {self.switch: self.share(recording)} if self.switch else {}
        return {**self.shapes, **dict.fromkeys(self.amplitudes, size), **switch}

    def added_to(self, model: Model, start: Mapping[str, float] | None = None) -> Model:
        """The model with the effect, its amplitudes starting at `start` (default: a tenth of plausible)."""
        start, amplitude = start or {}, self.effect.amplitude
        usual = (
            amplitude.fixed
            if amplitude.fixed is not None
            else 0.1 * amplitude.plausible * (amplitude.sign or 1)
        )
        parameters: dict[str, Parameter] = {}
        low, high = amplitude.ends
        for name in self.amplitudes:
            value, fixed = start.get(name, usual), amplitude.fixed is not None
            parameters[name] = Parameter(value, self._unit(name), low, high, fixed)
        for (name, value), shape in zip(self.shapes.items(), self.effect.shapes, strict=True):
            low, high = shape.ends
            parameters[name] = Parameter(start.get(name, value), self._unit(name), low, high, shape.instant)
        if self.switch:
            acting = {run: self.share(run) for run in self.acting}
            parameters[self.switch] = Parameter(0.0, "1", -inf, inf, True, True, values=acting)
        outputs = {
            name: Apply("+", (model.outputs.get(name, Name(name)), extra))
            for name, extra in self.shows(model).items()
        }
        return model.with_terms(*self.terms, parameters=parameters, outputs=outputs)

    def shows(self, model: Model) -> dict[str, Expression]:
        """Change of the outputs when the effect is added to any model."""
        found: dict[str, Expression] = {}
        for name, change in self.shown.items():
            y = model.outputs.get(name, Name(name))
            if self.effect.place == "seat":
                moved = Apply("+", (Name(self.states[0]), change))
                found[name] = Apply("-", (substitute(y, {self.states[0]: moved}), y))
            else:
                found[name] = substitute(change, {BEFORE.id: y})
        return found

    def _unit(self, name: str) -> str:
        return self.units.get(name, "1")
