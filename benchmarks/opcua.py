"""Ten minutes of the OPC UA loop at 1 Hz against the simulated machine: share of ticks in time.

python benchmarks/opcua.py [seconds]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from discovery.export.document import read_document, write_document
from discovery.export.makedocument import make_document
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime.opcua import compensate_opcua

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"


def main(seconds: float) -> None:
    """Print the punctuality of the loop."""
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "model.json"
        write_document(path, make_document(model, campaign, ["fit"], step_s=1.0))
        compensate_opcua(
            read_document(path), None, model=path, folder=Path(name) / "memory", seconds=seconds, say=print
        )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 600.0)
