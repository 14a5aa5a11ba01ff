"""Own effects that have no place in the model, with the reason."""

from __future__ import annotations

from collections.abc import Sequence

from discovery.effects.candidates import candidates
from discovery.effects.form import ROLE_OF, Effect
from discovery.effects.scene import Scene
from discovery.models import Model
from discovery.terms import names, parse

_FED = {  # roles of which a place needs one: of bodies or terms that the model couples to such a channel
    "wet body": ("fluid temperature",),
    "fluid terms": ("fluid temperature",),
    "driven body": ("heat load", "rotation speed"),
    "driven and another": ("heat load", "rotation speed"),
    "loss terms": ("heat load", "rotation speed", "other input"),
    "loss terms and a neighbour": ("heat load", "rotation speed", "other input"),
    "heat of a body": ("heat load", "rotation speed", "other input"),
    "air body": ("ambient temperature",),
    "air terms": ("ambient temperature",),
    "coolant terms": ("coolant temperature",),
    "cooling terms": ("cooling power",),
}


def not_offered(model: Model, scene: Scene, own: Sequence[Effect]) -> list[str]:
    """A sentence for each effect that has no place in the model."""
    there = {channel.role for channel in scene.channels.values()}
    said = []
    for effect in own:
        if candidates(model, [effect], scene):
            continue
        used = names(parse(effect.formula, f"effect {effect.word}"))
        lacking = [role for variable, role in ROLE_OF.items() if variable in used and role not in there]
        fed = _FED.get(effect.place, ())
        if fed and not there & set(fed):
            lacking += [role for role in fed if role not in lacking]
        why = (
            f"no channel has the role {' or '.join(repr(role) for role in lacking)}"
            if lacking
            else f"the model has no place of the kind '{effect.place}' where its channels could act"
        )
        said.append(f"{effect.word} was not searched: {why}")
    return said
