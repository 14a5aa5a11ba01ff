"""A heat exchanger: two flows, two fluids that flow in, two that flow out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from discovery.cli import app

UA, HELD, CAPACITY = 300.0, 8000.0, 70.0  # W/K between both streams, J/K of each, W/K for 1 l/min
NOISE = 0.05  # K


def recording(seed: int) -> pd.DataFrame:
    """Fifty minutes: C dT/dt = c flow (T_in - T) -/+ UA (T_hot - T_cold), flows in steps."""
    rng, time = np.random.default_rng(seed), np.arange(1500) * 2.0
    hot, cold = (np.repeat(rng.uniform(3, 10, 11), steps)[:1500] for steps in (150, 170))
    entering = 60 + np.cumsum(rng.normal(0, 0.05, 1500)), 15 + 2 * np.sin(time / 900)

    def rates(t: float, x: np.ndarray) -> list[float]:
        i, over = min(int(t // 2), 1499), UA * (x[0] - x[1])
        flows = CAPACITY * hot[i] * (entering[0][i] - x[0]), CAPACITY * cold[i] * (entering[1][i] - x[1])
        return [(flows[0] - over) / HELD, (flows[1] + over) / HELD]

    leaving = solve_ivp(rates, (0, time[-1]), [40, 25], t_eval=time, max_step=2).y
    read = [np.round(one + rng.normal(0, NOISE, 1500), 2) for one in (*entering, *leaving)]
    names = ("T_hot_in", "T_cold_in", "T_hot_out", "T_cold_out")
    flows = {"time_s": time, "flow_hot_lpm": hot.round(3), "flow_cold_lpm": cold.round(3)}
    return pd.DataFrame(flows | dict(zip(names, read, strict=True)))


EXPERIMENT = """
name = "exchanger"
campaign = "campaign.toml"
outputs = ["T_hot_out", "T_cold_out"]
fit = ["run0", "run1"]
held_out = ["run2"]
cross_validate = false
[models]
first_order = { file = "model.toml" }
discovered = { kind = "sindy", bootstraps = 0 }
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exchanger")
    files = []
    for k in range(3):
        recording(k).to_csv(folder / f"run{k}.csv", index=False)
        files += ["--from", str(folder / f"run{k}.csv")]
    made = CliRunner().invoke(app, ["new", str(folder / "made"), "--quick", *files])
    assert made.exit_code == 0, made.output
    assert "what heats the machine" not in made.output
    return folder / "made"


def test_the_model_of_an_exchanger_predicts_to_the_noise(made: Path, tmp_path: Path) -> None:
    """Each flow may carry each fluid; which one it carries is found."""
    (made / "streams.toml").write_text(EXPERIMENT)
    done = CliRunner().invoke(app, ["run", str(made / "streams.toml"), "--out", str(tmp_path / "run")])
    assert done.exit_code == 0, done.output
    models = json.loads((tmp_path / "run" / "results.json").read_text())["models"]

    def left(name: str) -> list[float]:
        return [one["rms"] for one in models[name]["recordings"]["run2"].values()]

    assert max(left("discovered")) < 1.5 * NOISE
    assert min(left("first_order")) > 5 * NOISE  # it has no exchange between the streams
