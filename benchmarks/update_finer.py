"""`discovery update` on the finer plant, whose laws are not the model's: python -m benchmarks.update_finer

A line for each case: what was done, the verdict, the log odds of each hypothesis against no change.
"""

from __future__ import annotations

from pathlib import Path

from discovery.export.document import from_document, render
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime.hypotheses import compare
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import Request
from tests.runtime.test_update import days, less_loss, warm_room

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"


def main() -> None:
    """Fit the thermobalance to `fit`, then compare days of the plant with it."""
    machine = load_campaign(DATA / "campaign.toml", only=["fit", "validation"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), machine, ["fit"]).model
    exported = from_document(*open_seal(render(make_document(model, machine, ["fit"])), "update"), "update")
    gap = (Request("flooded_gap", 60.0, ("b_body_1", "c_body_1")),)
    swarf = (Request("swarf_heat", 200.0, ("table",)),)
    near = (Request("conduction_path", 60.0, ("b_body_2", "c_body_1")),)
    far = (Request("conduction_path", 60.0, ("b_body_2", "table")),)
    cases = {}
    for count in (8, 24):
        given = f", {count} readings a day"
        cases |= {
            f"three unchanged days{given}": days(machine, 3, five_axis(), (), count),
            f"losses less by 10 %{given}": days(machine, 3, five_axis(), less_loss(0.9), count),
            f"losses less by 20 %{given}": days(machine, 3, five_axis(), less_loss(0.8), count),
            f"room sensor +1.5 K{given}": warm_room(days(machine, 3, five_axis(), (), count)),
            f"flooded gap 60 W/K{given}": days(machine, 3, five_axis(), gap, count),
            f"hot swarf{given}": days(machine, 3, five_axis(), swarf, count),
            f"a path from c_body_1 to b_body_2{given}": days(machine, 3, five_axis(), near, count),
            f"a path from the table to b_body_2{given}": days(machine, 3, five_axis(), far, count),
        }
    print("unchanged, validation:", compare(exported, machine, ["validation"]))
    for name, campaign in cases.items():
        print(f"{name}:", compare(exported, campaign, list(campaign.recordings)))


if __name__ == "__main__":
    main()
