"""A switch is on as much as it is off elsewhere: it is written the other way round."""

from pathlib import Path

import numpy as np
import pytest

from discovery.recordings.compare.repairs import is_switch
from discovery.recordings.compare.seen import Seen
from discovery.recordings.compare.switches import used_inverted

TIME = np.linspace(0.0, 23940.0, 400)


def pumped(name: str, share: float) -> Seen:
    values = (np.arange(TIME.size) % 100 < 100 * share).astype(float)
    values[[30, 230]] = 0.4  # rows in which it was switched: a logger writes means
    return Seen(name, Path(f"{name}.csv"), TIME, {"pump": values}, np.arange(TIME.size))


@pytest.mark.parametrize(
    ("here", "elsewhere", "inverted"),
    [
        (0.08, (0.90, 0.94, 0.96), True),
        (0.92, (0.90, 0.94, 0.96), False),
        (0.50, (0.90, 0.94, 0.96), False),  # used otherwise
        (0.30, (0.30, 0.70, 0.90), False),  # it is used in many ways
        (0.08, (0.92,), False),  # one other recording is no usage
    ],
)
def test_usage(here: float, elsewhere: tuple[float, ...], inverted: bool) -> None:
    one = pumped("here", here)
    others = [pumped(f"run{k}", share) for k, share in enumerate(elsewhere)]
    assert used_inverted(one, [one, *others], "pump") is inverted


def test_what_a_switch_is() -> None:
    assert is_switch(pumped("a", 0.9).values["pump"])
    assert not is_switch(np.linspace(0.0, 1.0, 50))  # a share
    assert not is_switch(np.where(np.arange(50) < 25, 0.0, 8.0))  # a flow
    assert not is_switch(np.full(9, np.nan))
