"""What candidates are made for: the channels that a formula may mean, and the recordings in which it acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from discovery.effects.form import INPUT, RATE, ROLE_OF, Effect
from discovery.effects.places import TEMPERATURES
from discovery.models import Model
from discovery.models.units import same_dimension
from discovery.recordings import Channel
from discovery.recordings.roles import FLOWS


@dataclass(frozen=True)
class Scene:
    """What candidates are made for.

    `after`: by recording to fit, the recordings of the campaign that were made then or later, it included.
    `largest`: the largest magnitude of each input that moves, over the recordings to fit.
    `unused`: inputs that the model does not use. `odds` of each effect to act, `event_odds` of each event in
    each recording. `spacing`: seconds between readings.
    """

    channels: Mapping[str, Channel]
    outputs: tuple[str, ...]
    recordings: tuple[str, ...]
    after: Mapping[str, tuple[str, ...]]
    largest: Mapping[str, float]
    unused: frozenset[str]
    odds: float
    event_odds: float
    spacing: float = 0.0


def channels_for(variable: str, effect: Effect, model: Model, scene: Scene) -> list[str]:
    """Channels that a variable of a formula may be."""
    there = [n for n in scene.channels if n not in model.states and n not in model.outputs]
    if variable in ROLE_OF:
        fits = [n for n in there if scene.channels[n].role == ROLE_OF[variable]]
        if variable == "flow":  # of several, those of the model wet it; another one is an input of its own
            fits = [n for n in fits if n not in scene.unused] or fits
        if variable == "other_input" and effect.amplitude.unit == "1":  # a share of it is heat
            fits = [n for n in fits if same_dimension(scene.channels[n].unit, "W")]
        return fits
    if variable == RATE:
        return [n for n in there if n in scene.largest and _is_flow(scene.channels[n])]
    return [
        n
        for n in there
        if n in scene.largest
        and (variable == INPUT or scene.channels[n].unit not in TEMPERATURES)  # half of 20 degC is no level
        and scene.channels[n].role in effect.roles
        and (not effect.inputs_in or same_dimension(scene.channels[n].unit, effect.inputs_in))
        and (
            effect.place.startswith("output")
            or scene.channels[n].role != "fluid flow"
            or _has_no_law(n, scene)
        )
    ]


def _is_flow(channel: Channel) -> bool:
    return channel.role == "fluid flow" or is_flow_unit(channel.unit)


def is_flow_unit(unit: str) -> bool:
    """Whether a unit is one of volume or of mass in a time."""
    return any(same_dimension(unit, flow) for flow in FLOWS)


def _has_no_law(name: str, scene: Scene) -> bool:
    """Whether a flow is not the one in the laws of the fluid: that one is in the model, or any flow if the
    model is dry. Where nobody reads the temperature of a fluid, there are no such laws.
    """
    flows = [n for n, c in scene.channels.items() if c.role == "fluid flow"]
    is_second = name in scene.unused and not scene.unused.issuperset(flows)
    return is_second or all(c.role != ROLE_OF["fluid"] for c in scene.channels.values())


def recordings_for(effect: Effect, scene: Scene) -> list[tuple[str | None, bool]]:
    """The recordings in which an effect acts or begins to act, each with whether it grows from there on; None
    stands for all of them. What lasts from the first one on is the model's own parameter, but for the zero of
    a thermometer, which later ones tell apart. Growth begins with the second one; of two it is a step.
    """
    if effect.acts == "always":
        return [(None, False)]
    steps: list[tuple[str | None, bool]] = [(run, False) for run in scene.recordings]
    if not effect.lasts or effect.place == "input temperature":
        return steps
    every = set(scene.recordings)
    later = [run for run in scene.recordings if not every <= set(scene.after[run])]
    steps = [(run, False) for run in later]
    if effect.acts == "as parts age" and later[1:]:
        steps.append((max(later, key=lambda run: len(scene.after[run])), True))
    return steps
