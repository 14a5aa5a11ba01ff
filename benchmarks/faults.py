"""1000 random fault sequences over 72 h of the virtual machine, and the cost of each known fault at every
hour.

python benchmarks/faults.py [sequences]
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as some

from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.seal import open_seal
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime.injection import KINDS, Injection, try_faults, violations

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
TICK = 60.0


def machine() -> tuple[Exported, np.ndarray]:
    """The fitted thermobalance and the inputs of the recording that its fit has not seen."""
    campaign = load_campaign(DATA / "campaign.toml", only=["fit", "validation"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model
    data = render(make_document(model, campaign, ["fit"]))
    exported = from_document(*open_seal(data, "model"), "model")
    return exported, sampled_inputs(campaign, "validation", exported.compiled.inputs, TICK)


def costs(exported: Exported, inputs: np.ndarray) -> None:
    """Worst extra error of the faults of the table, each beginning at every hour from 2 to 68."""
    clean = try_faults(exported, inputs, [], TICK).offsets
    for title, kind, channel, hours, size in (
        ("ambient sensor +15 K for 2 h", "offset", "T_env", 2, 15.0),
        ("fluid sensor bad for 1 h", "quality", "T_fluid", 1, 0.0),
        ("link lost for 2 h", "link", "T_env", 2, 0.0),
    ):
        worst = [
            np.max(
                np.abs(
                    try_faults(
                        exported, inputs, [Injection(kind, channel, h * 3600, hours * 3600, size)], TICK
                    ).offsets
                    - clean
                )
            )
            for h in range(2, 69)
        ]
        print(
            f"{title}: worst extra error {max(worst):.2f} um (median over 67 beginnings "
            f"{np.median(worst):.2f})"
        )


def sequences(exported: Exported, inputs: np.ndarray, count: int) -> None:
    """Random sequences of faults; every offset of every tick is judged."""
    total: Counter[str] = Counter()
    length = len(inputs) * TICK
    fault = some.builds(
        Injection,
        some.sampled_from(KINDS),
        some.sampled_from(exported.compiled.inputs),
        some.floats(0, length),
        some.one_of(some.floats(60, 1200), some.floats(1200, 0.2 * length)),
        some.one_of(some.floats(-30, 30), some.floats(allow_nan=True, allow_infinity=True)),
    )

    @settings(
        max_examples=count,
        deadline=None,
        derandomize=True,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(some.lists(fault, min_size=1, max_size=8))
    def run(faults: list[Injection]) -> None:
        trial = try_faults(exported, inputs, faults, TICK)
        total.update(violations(exported, trial, TICK))
        total.update({"sequences": 1, "ticks": len(inputs), **Counter(trial.states)})

    run()
    print(", ".join(f"{name} {number}" for name, number in total.items()))


if __name__ == "__main__":
    began = time.perf_counter()
    model, rows = machine()
    costs(model, rows)
    sequences(model, rows, int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
    print(f"{time.perf_counter() - began:.0f} s")
