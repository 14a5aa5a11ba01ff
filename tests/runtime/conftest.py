"""The virtual machine's thermobalance, fitted once and exported, and the inputs of a recording no fit has
seen.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.seal import open_seal
from discovery.fitting import fit_model
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.recordings import Campaign, load_campaign

DATA = Path(__file__).parents[2] / "datasets" / "nmv5000"


@pytest.fixture(scope="session")
def machine() -> Campaign:
    return load_campaign(DATA / "campaign.toml", only=["fit", "validation"])


@pytest.fixture(scope="session")
def fitted(machine: Campaign) -> Model:
    return fit_model(read_model(DATA / "thermobalance.toml"), machine, ["fit"]).model


@pytest.fixture(scope="session")
def document(fitted: Model, machine: Campaign) -> bytes:
    return render(make_document(fitted, machine, ["fit"]))


@pytest.fixture(scope="session")
def exported(document: bytes) -> Exported:
    return from_document(*open_seal(document, "test"), "test")


@pytest.fixture(scope="session")
def minutes(machine: Campaign, exported: Exported) -> np.ndarray:
    """Inputs of 72 h, every 60 s."""
    return sampled_inputs(machine, "validation", exported.compiled.inputs, 60.0)


@pytest.fixture(scope="session")
def model_file(document: bytes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "model.json"
    path.write_bytes(document)
    return path
