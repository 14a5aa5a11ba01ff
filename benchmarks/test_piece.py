"""A test piece instead of an R-Test: a dozen features, each one reading of one error, for `discovery update`.

    python benchmarks/test_piece.py [days] [features a day]

The thermobalance is fitted to `fit` and exported. Then days of machines that nobody has looked at are written
as a shop would have them: the log of the inputs in its own rows, a row for each feature with the deviation in
the column of its error and all other cells empty. `discovery update` compares the model with them: an
unchanged machine, losses down by 10, 20 and 30 %.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from discovery.export.document import write_document
from discovery.export.makedocument import make_document
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime.update import update_file
from discovery.virtual.record import Order, Request, take

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
SEED = 7100


def piece(folder: Path, name: str, seed: int, wear: float, features: int) -> str:
    """Write a day of the machine with the features of a test piece; its entry of the campaign file."""
    effects = tuple(Request("wear", wear, (body,)) for body in ("c_body_1", "c_body_2")) if wear else ()
    table = pd.DataFrame(take(Order(name, "fit", seed, 24.0, effects=effects, age=1.0)).columns)
    read = np.flatnonzero(np.isfinite(table[ERRORS[0]]))
    rows = [table.drop(columns=[*ERRORS, "E_X0C"])]
    for k, i in enumerate(read[np.linspace(0, len(read) - 1, features).astype(int)]):
        error = ERRORS[k % len(ERRORS)]
        rows.append(pd.DataFrame({"time": [table["time"][i] + 1.0], error: [round(table[error][i], 2)]}))
    pd.concat(rows).sort_values("time").to_csv(folder / f"{name}.csv", index=False)
    return f'{name} = {{ file = "{name}.csv" }}\n'


def main(days: int, features: int) -> None:
    """Compare the model with each machine, and say what `discovery update` answers."""
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"], ERRORS).model
    with TemporaryDirectory() as place:
        folder = Path(place)
        write_document(folder / "model.json", make_document(model, campaign, ["fit"]))
        lines = (DATA / "campaign.toml").read_text().split("[recordings]")[0].splitlines(keepends=True)
        channels = "".join(line for line in lines if not line.startswith("E_X0C"))
        for wear in (0.0, 0.1, 0.2, 0.3):
            names = [f"day_{k}" for k in range(days)]
            entries = "".join(piece(folder, n, SEED + k, wear, features) for k, n in enumerate(names))
            (folder / "campaign.toml").write_text(f"{channels}[recordings]\n{entries}")
            seen = load_campaign(folder / "campaign.toml")
            found = update_file(folder / "model.json", seen, names, folder / "next.json")
            print(f"losses -{100 * wear:.0f} %, {days} x {features} features: {found.lines()[0]}", flush=True)
            if found.path is not None:
                moved = {n: round(v[0], 3) for n, v in found.comparison.change.items()}
                print(f"    {found.lines()[-1].split(': ', 1)[1]}; moved {moved}", flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in (sys.argv[1:] + ["3", "12"][len(sys.argv) - 1 :])))
