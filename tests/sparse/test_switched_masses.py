"""A body under a fluid forgets faster than one that has run dry: its time constant follows the pump."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.dynamics import predict
from discovery.fitting import predict_recording
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.discover import discover
from discovery.sparse.library import STILL, Feature, FilteredInputs
from discovery.sparse.options import SparseOptions

Array = NDArray[np.float64]

WET, DRY, GAIN, NOISE = 2400.0, 16_000.0, 0.03, 0.3


def held(rng: np.random.Generator, levels: list[float], count: int, most: int) -> Array:
    """Levels that are held for up to `most` rows."""
    return np.concatenate(
        [np.full(int(rng.integers(most // 4, most)), rng.choice(levels)) for _ in range(count)]
    )


def body(drive: Array, pump: Array, step: float) -> Array:
    """WET ds/dt = drive - (WET/DRY + (1 - WET/DRY) pump) s, in small steps."""
    out, s, rest = np.zeros(len(drive)), 0.0, WET / DRY
    for k in range(len(drive)):
        out[k] = s
        for _ in range(20):
            s += step / 20 / WET * (drive[k] - (rest + (1 - rest) * pump[k]) * s)
    return out


def recording(seed: int) -> Recording:
    """48 h with inputs each minute and a reading each ten minutes."""
    rng, rows = np.random.default_rng(seed), 48 * 60
    load: Array = held(rng, [0.0, 200.0, 500.0, 900.0], 60, 180)[:rows]
    pump = held(rng, [1.0, 1.0, 1.0, 0.0], 60, 150)[:rows]
    room = np.asarray(22.0 + np.cumsum(0.02 * rng.standard_normal(rows)), dtype=np.float64)
    error = body(GAIN * load, pump, 60.0) + NOISE * rng.standard_normal(rows)
    error[np.arange(rows) % 10 > 0] = np.nan
    time = np.asarray(60.0 * np.arange(rows), dtype=np.float64)
    return Recording(f"r{seed}", time, {"P": load, "pump": pump, "T_env": room, "E": error})


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "pump": Channel("pump", "fluid flow", "1", None, "held"),
        "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
        "E": Channel("E", "error", "um", NOISE, "linear"),
    }
    return Campaign("c", channels, {f"r{k}": recording(k) for k in range(3)}, Path("c"))


def test_lags_of_a_gate_are_exact() -> None:
    rng, rows = np.random.default_rng(5), 400
    load, pump = held(rng, [0.0, 1.0, 3.0], 20, 60)[:rows], held(rng, [0.0, 1.0], 20, 60)[:rows]
    table = np.column_stack([60.0 * np.arange(rows), load, pump])
    library = FilteredInputs(["time", "P", "pump"], ["P"], (600.0, 60_000.0), gate="pump")
    library.fit([table])
    assert [f for f in library.features_ if f.rest == STILL]
    feature = Feature("P", WET, WET / DRY)
    library.keep([feature])
    np.testing.assert_allclose(
        np.asarray(library.transform([table])[0])[:, 0], body(load, pump, 60.0), atol=2e-3 * load.max()
    )
    assert str(feature) == "lag(P, 2400, 1.6e+04)"


def test_a_body_that_forgets_more_slowly_without_fluid_is_found(campaign: Campaign) -> None:
    found = discover(campaign, ["r0", "r1"], ["E"], SparseOptions(bootstraps=0))
    assert [str(f).split(",")[0] for f in found.report["groups"][0]["kept"]] == ["lag(P"]
    values = found.model.parameters
    assert values["E_tau1"].value == pytest.approx(WET, rel=0.05)
    assert values["E_tau1"].value / values["E_rest1"].value == pytest.approx(DRY, rel=0.15)
    run = predict_recording(found.model, campaign, "r2", ["E"], [NOISE])
    left = run.system.grid.readings - predict(run)
    assert np.sqrt(np.mean(left**2)) < 1.1 * NOISE
