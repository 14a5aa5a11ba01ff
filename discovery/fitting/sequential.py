"""Equation (8) the paper's way: one influence at a time, from separate recordings.

"First, the model for environmental influences is developed ... With these derived parameters the machine tool
is compensated against environmental influences and the next input is investigated" (Mayr et al., section 4).
So each step fits eq. (7) to the residual of the influences identified before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from discovery.dynamics import outputs as model_outputs
from discovery.fitting.fit import fit_model
from discovery.fitting.heldout import predict_recording
from discovery.fitting.starts import warm_start
from discovery.models import Model, Parameter
from discovery.models.superposition import superposition
from discovery.recordings import Campaign, Recording


def fit_one_at_a_time(
    campaign: Campaign, separate: Mapping[str, Sequence[str]], outputs: Sequence[str]
) -> Model:
    """Eq. (8) found influence by influence; its parameters are `fixed` and keep the intervals of their step.

    Args:
        campaign: holds the separate recordings.
        separate: input -> recordings in which it acts, in the order of identification. An input that was
            identified before may act in them too.
        outputs: errors.
    """
    known: list[Model] = []
    parameters: dict[str, Parameter] = {}
    for k, (channel, recordings) in enumerate(separate.items()):
        left = {name: compensated(campaign, name, known, outputs) for name in recordings}
        rest = replace(campaign, recordings=left)
        single = warm_start(superposition([channel], outputs, campaign.channels), rest, recordings, outputs)
        known.append(fit_model(single, rest, recordings, outputs).model)
        for output in outputs:
            for j in (1, 2, 3):
                found = known[-1].parameters[f"p{j}_{output}"]
                parameters[f"p{3 * k + j}_{output}"] = replace(found, fixed=True)
    whole = superposition(list(separate), outputs, campaign.channels)
    return replace(whole, parameters={name: parameters[name] for name in whole.parameters})


def compensated(
    campaign: Campaign, recording: str, known: Sequence[Model], outputs: Sequence[str]
) -> Recording:
    """The recording as a machine would show it that compensates the known influences.

    As in the whole of eq. (8), the first influence takes up the first reading and forgets it at its own pace:
    left in the readings, it would become a zero balance of the next influence, in that recording alone right.
    """
    data = campaign.recordings[recording]
    for model in known:
        rest = replace(campaign, recordings={recording: data})
        trajectory = predict_recording(model, rest, recording, outputs)
        time, values = trajectory.system.grid.time, dict(data.values)
        for name, dual in zip(outputs, model_outputs(trajectory), strict=True):
            part = np.broadcast_to(dual.value, time.shape)
            values[name] = values[name] - np.interp(data.time, time, part)
        data = replace(data, values=values)
    return data
