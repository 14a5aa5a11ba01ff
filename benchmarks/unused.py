"""A recorded input that the model does not use: python -m benchmarks.unused

A line for each gain of a simulated fan: the comparison, what the next revision has, the residual it leaves.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.ageing import sealed
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime.hypotheses import compare
from discovery.runtime.update import revision_of
from discovery.virtual.nmv5000.plant import five_axis
from tests.runtime.test_unused import with_fan
from tests.runtime.test_update import days

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"


def main() -> None:
    """Fit the thermobalance to `fit`, then compare three days with a fan with it."""
    machine = load_campaign(DATA / "campaign.toml", only=["fit"])
    exported = sealed(fit_model(read_model(DATA / "thermobalance.toml"), machine, ["fit"]).model, machine)
    quiet = days(machine, 3, five_axis(), readings=24)
    for gain in (0.0, 0.1, 0.3, 1.0):
        campaign = with_fan(quiet, gain)
        found = compare(exported, campaign, list(campaign.recordings), choose=True)
        revised = revision_of(exported, campaign, found)
        print(f"gain {gain:g}: {found}", flush=True)
        if found.path is not None and revised is not None:
            values = ", ".join(f"{n} {v:.3g}" for n, v in found.path[1].items() if "_to_" in n)
            print(f"    {found.path[0]}: {values}; residual {revised[1]:.2f} after it")


if __name__ == "__main__":
    main()
