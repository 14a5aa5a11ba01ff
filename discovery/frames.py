"""Notebooks: pandas frames in and out, for the same steps that the commands take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.recordings import Campaign, Recording
from discovery.recordings.campaign import make_channel
from discovery.recordings.campaignfile import ChannelForm
from discovery.recordings.correction import pair_corrections, uncompensated
from discovery.recordings.units import UnitError, conversion
from discovery.schema import suggest

if TYPE_CHECKING:
    import pandas as pd

    from discovery.models import Model


def campaign_from_frames(
    frames: Mapping[str, pd.DataFrame], channels: Mapping[str, Mapping[str, Any]], name: str = "notebook"
) -> Campaign:
    """Make a campaign from pandas frames.

    Args:
        frames: recordings by name; the index is time (seconds, or a DatetimeIndex), NaN means "not measured".
        channels: column -> {"role": ..., "unit": ...} as in a campaign file; other columns are not used.

    Returns:
        The campaign, in canonical units.

    Raises:
        UserError: an unknown role or unit, a column that is missing, an index that does not run forward.
    """
    from pydantic import ValidationError

    forms, rules = {}, {}
    for column, entry in channels.items():
        try:
            form = forms[column] = ChannelForm.model_validate(dict(entry))
            rules[column] = conversion(form.unit, form.role)
        except UnitError as error:
            raise UserError(f"channel '{column}': {error}") from None
        except ValidationError as error:
            what = error.errors(include_url=False)[0]
            place = "".join(f", {key}" for key in what["loc"])
            raise UserError(f"channel '{column}'{place}: {what['msg']}") from None
    pairs, mistakes = pair_corrections(forms, {column: rule.unit for column, rule in rules.items()})
    for where, sentence in mistakes:
        raise UserError(f"channel '{where[1]}': {sentence}")
    made = {column: make_channel(column, form, rules[column]) for column, form in forms.items()}
    recordings = {}
    for key, frame in frames.items():
        missing = next((column for column in channels if column not in frame), None)
        if missing is not None:
            hint = suggest(missing, [str(c) for c in frame.columns])
            raise UserError(f"recording '{key}': no column '{missing}'; {hint}")
        values = {c: rule.factor * frame[c].to_numpy(float) + rule.offset for c, rule in rules.items()}
        time = _seconds(key, frame)
        recordings[key] = Recording(
            key, time, uncompensated(f"recording '{key}'", time, values, forms, pairs)
        )
    return Campaign(name, made, recordings, Path(name))


def _seconds(key: str, frame: pd.DataFrame) -> NDArray[np.float64]:
    import pandas as pd

    index = frame.index
    stamps = (index - index[0]).total_seconds() if isinstance(index, pd.DatetimeIndex) else index - index[0]
    seconds = np.asarray(stamps, dtype=float)
    if not (np.diff(seconds) > 0).all():
        raise UserError(f"recording '{key}': its index does not run forward; use frame.sort_index()")
    return seconds


def recording_frame(campaign: Campaign, recording: str) -> pd.DataFrame:
    """Return a recording as a frame: index time [s], a column for each channel in its canonical unit.

    Raises:
        UserError: no such recording.
    """
    import pandas as pd

    data = campaign.recordings[recording]
    return pd.DataFrame(dict(data.values), index=pd.Index(data.time, name="time"))


def prediction_frame(
    model: Model,
    campaign: Campaign,
    recording: str,
    outputs: Sequence[str],
    zeros: Mapping[str, tuple[float, float]] | None = None,
) -> pd.DataFrame:
    """Run a model freely on a recording.

    Args:
        zeros: what the fit of the model found of the zeros of outputs and of inputs known only within a
            spread (`Fit.zeros`), as the table of a run has it; default nothing.

    Returns:
        A frame with the index time [s] of the readings. Each output NAME has three columns: the reading
        (NAME), the prediction (NAME|model) and the residual, reading minus prediction (NAME|left).

    Raises:
        UserError: no such recording or channel.
        RunsAwayError: the model does not stay finite.
    """
    import pandas as pd

    from discovery.dynamics import predict
    from discovery.fitting import predict_recording

    trajectory = predict_recording(model, campaign, recording, list(outputs), zeros=zeros)
    grid, predicted = trajectory.system.grid, predict(trajectory)
    columns = {}
    for y, output in enumerate(outputs):
        columns[output] = grid.readings[:, y]
        columns[f"{output}|model"] = predicted[:, y]
        columns[f"{output}|left"] = grid.readings[:, y] - predicted[:, y]
    return pd.DataFrame(columns, index=pd.Index(grid.time[grid.read], name="time"))
