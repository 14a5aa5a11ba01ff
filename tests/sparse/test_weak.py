"""The weak form on a closed-form solution, read at irregular instants."""

from pathlib import Path

import numpy as np

from discovery.dynamics import make_grid
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.gram import solve
from discovery.sparse.weak import weak_rows
from discovery.terms import parse


def test_weak_form_finds_the_rate_and_the_gain_of_a_step() -> None:
    time = np.asarray(np.arange(0.0, 86401.0, 60.0), dtype=np.float64)
    switch, rate, gain = 7200.0, 1 / 5400, 0.003
    since = np.clip(time - switch, 0, None)
    y = np.asarray(gain / rate * (1 - np.exp(-rate * since)))
    read = np.zeros(len(time), dtype=bool)
    read[np.cumsum(np.random.default_rng(0).integers(4, 12, 170))] = True
    channels = {
        "u": Channel("u", "heat load", "W", None, "held"),
        "y": Channel("y", "error", "um", 0.5, "linear"),
    }
    recording = Recording(
        "r", time, {"u": np.where(time >= switch, 1.0, 0.0), "y": np.where(read, y, np.nan)}
    )
    grid = make_grid(Campaign("c", channels, {"r": recording}, Path("c")), "r", ["u"], ["y"])
    found = solve(weak_rows(grid, "y", [parse("y"), parse("u")]).gram, (0, 1))
    np.testing.assert_allclose(found, [-rate, gain], rtol=0.02)
