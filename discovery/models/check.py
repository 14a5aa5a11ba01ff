"""Whether model files fit a campaign: names that it has, units that go together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.files import locate, read_text, read_toml
from discovery.models.accept import check_model
from discovery.models.dimensions import check_dimensions
from discovery.models.model import Model
from discovery.models.modelfile import read_model
from discovery.recordings.campaign import Channel, make_channel
from discovery.recordings.campaignfile import CampaignForm, campaign_path
from discovery.recordings.units import UnitError, conversion


def check_models(campaign: Path, models: Sequence[Path]) -> Iterator[str]:
    """A sentence for each place where the units of a model do not fit.

    Raises UserError: a mistake in a file, or a model that cannot be used with the campaign.
    """
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
