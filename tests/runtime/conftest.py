"""The virtual machine's thermobalance, fitted once and exported, and the inputs of a recording no fit has
seen.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
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
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.session import Session
from discovery.runtime.watch import server

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


@pytest.fixture(scope="session")
def recorded_folder(
    exported: Exported, model_file: Path, minutes: np.ndarray, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A day and a half with a sensor lost for half an hour and measured errors every hour."""
    folder = tmp_path_factory.mktemp("memory")
    session = Session(exported, model=model_file, folder=folder, settings=Settings(tick_s=60.0))
    names = exported.compiled.inputs
    for k in range(2160):
        readings = {n: Reading(v, 60.0 * k) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        if 1500 <= k < 1530:
            del readings["T_fluid"]
        if k % 60 == 0:
            readings["E_Y0C"] = Reading(float(k) / 1000.0, 60.0 * k)
        session.tick(readings, 60.0 * k)
    session.close(60.0 * 2159)
    return folder


@pytest.fixture
def address(recorded_folder: Path) -> Iterator[str]:
    found = server(recorded_folder, 0, 24.0)
    thread = threading.Thread(target=found.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{found.server_address[1]}"
    found.shutdown()
    thread.join()
    found.server_close()
