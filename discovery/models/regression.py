"""Regression on the inputs, without memory: what a user would pick first.

y = b0 + sum_k b_k u_k
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from discovery.models.model import Model, Parameter
from discovery.models.reduced import per_unit
from discovery.recordings import Channel
from discovery.terms import parse


def regression(inputs: Sequence[str], outputs: Sequence[str], channels: Mapping[str, Channel]) -> Model:
    """A model without states for every output; parameters b0_E, b1_E, ... in the order of the inputs.

    Args:
        inputs: channels u1, u2, ...
        outputs: measured channels.
        channels: of the campaign, for the units.
    """
    parameters: dict[str, Parameter] = {}
    found = {}
    for output in outputs:
        unit = channels[output].unit
        parameters[f"b0_{output}"] = Parameter(0.0, unit)
        parts = [f"b0_{output}"]
        for k, channel in enumerate(inputs, start=1):
            parameters[f"b{k}_{output}"] = Parameter(0.0, per_unit(unit, channels[channel].unit))
            parts.append(f"b{k}_{output}*{channel}")
        found[output] = parse(" + ".join(parts))
    return Model("regression", parameters, {}, (), found, "s")
