"""Whether a model file can be used with a campaign: names that are known, units that models count in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.files import locate, read_text, read_toml
from discovery.models.dimensions import check_dimensions
from discovery.models.memory import check_before_fit
from discovery.models.model import Model
from discovery.models.modelfile import read_model
from discovery.models.units import atoms, dimension, known, of_atom, ratio
from discovery.recordings.campaign import Channel, make_channel
from discovery.recordings.campaignfile import CampaignForm, campaign_path
from discovery.recordings.units import UnitError, conversion, short
from discovery.terms import Expression, names

# Values are never converted: what stands in one of these can be compared with what a channel gives.
_COUNTED = (("K",), ("W",), ("J",), ("s", "min", "h", "d"), ("um", "mm", "m"), ("l", "m**3"), ("kg",))


def check_models(campaign: Path, models: Sequence[Path]) -> Iterator[str]:
    """A sentence for each place where the units of a model do not fit.

    A path that does not exist is looked for next to the campaign file.

    Raises UserError: a mistake in a file, or a model that cannot be used with the campaign.
    """
    folder = campaign_path(campaign).parent
    models = [folder / path if not path.exists() and (folder / path).exists() else path for path in models]
    form = read_toml(campaign_path(campaign), CampaignForm)
    channels = {}
    for name, one in form.channels.items():
        try:
            channels[name] = make_channel(name, one, conversion(one.unit, one.role))
        except UnitError:  # the check of the recordings has said so
            continue
    for path in models:
        model = read_model(path)
        check_model(model, {n: channels[n].unit if n in channels else "" for n in form.channels}, path)
        check_outputs(model, channels, path)
        yield from check_dimensions(model, channels)


def check_model(model: Model, channels: Mapping[str, str], path: Path | str) -> None:
    """Refuse a model file that would be read as something else than it says.

    Args:
        channels: of the campaign, each with the unit of its values.
        path: the file, for the message.

    Raises:
        UserError: a name that is neither the model's own nor a channel, or a parameter that is also one; a
        delay that a fit may make negative; a unit that models do not count in (kW, degF), unless a channel
        does.
    """
    _check_names(model, channels, path)
    for place, expression in _formulas(model):
        check_before_fit(expression, model.parameters, f"{path}, {place}")
    for key, unit in _units(model):
        _check_unit(unit, channels, f"{path}, key {key}.unit")


def check_outputs(model: Model, channels: Mapping[str, Channel], path: Path) -> None:
    """Refuse an output that bears the name of an input: nothing is measured there to compare it with.

    Raises:
        UserError: with the line of the output.
    """
    for name in model.outputs:
        if name in channels and not channels[name].measured:
            raise UserError(
                f"{path}, line {locate(read_text(path), ('outputs', name))}: outputs.{name}: '{name}' is an "
                f"input of the campaign ({channels[name].role}); rename the output, or change the role"
            )


def _check_names(model: Model, channels: Mapping[str, str], path: Path | str) -> None:
    for name in sorted(channels.keys() & model.parameters.keys()):
        raise UserError(
            f"{path}, key parameters.{name}: '{name}' is also a channel of the campaign; rename the parameter"
        )
    own = set(model.states) | set(model.parameters) | {"time"} | set(channels)
    places = _formulas(model)
    places += [(f"start of '{s.name}'", s.start) for s in model.states.values() if s.start is not None]
    for place, expression in places:
        for name in sorted(names(expression) - own):
            raise UserError(
                f"{path}, {place}: '{name}' is neither a state or parameter of the model "
                "nor a channel of the campaign "
                f"({', '.join(sorted(channels))}); correct the name or add the channel"
            )


def _formulas(model: Model) -> list[tuple[str, Expression]]:
    terms = [(f"term '{term.name}'", term.expression) for term in model.terms]
    return terms + [(f"output '{name}'", expression) for name, expression in model.outputs.items()]


def _units(model: Model) -> Iterator[tuple[str, str]]:
    for name, parameter in model.parameters.items():
        yield f"parameters.{name}", parameter.unit
    for name, state in model.states.items():
        yield f"states.{name}", state.unit


def _check_unit(unit: str, channels: Mapping[str, str], where: str) -> None:
    if unit == "" or not known(unit):  # the dimensions are checked elsewhere
        return
    recorded = {atom for of in channels.values() if of and known(of) for atom in atoms(of)}
    for atom in atoms(unit):
        if {atom, atom.removeprefix("delta_")} & recorded:
            continue
        for counted in _COUNTED:
            ratios = [ratio(of_atom(atom), _of(other)) for other in counted]
            if None not in ratios and 1.0 not in ratios:
                wanted = "degC, in differences K" if counted == ("K",) else " or ".join(counted)
                raise UserError(
                    f"{where}: '{unit}' counts in {short(atom)}, and a model converts no units; "
                    f"write unit, value and bounds in {wanted}"
                )


def _of(unit: str) -> dict[str, float]:
    found = dimension(unit)
    assert found is not None
    return dict(found)
