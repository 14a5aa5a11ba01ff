"""Discovery workbench: models of thermal errors from recordings, and what physics they miss.

    terms -> recordings -> models -> dynamics -> fitting, effects -> evidence, evaluation, sparse
        -> diagnosis -> design, report, export -> experiment, runtime

A folder each; an import goes only to the left (`tests/test_imports.py`). `virtual` makes recordings,
`challenge` puts the diagnosis to the proof, `firsthour` helps a user begin, `commands` holds the verbs of
`cli`.

Nothing heavy is imported here: ``import discovery`` takes a few milliseconds; each name below loads what
it needs.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.3.0"

if TYPE_CHECKING:
    from discovery.diagnosis import diagnose
    from discovery.errors import UserError
    from discovery.estimator import SparseDiscovery, discover
    from discovery.fitting import fit_model
    from discovery.frames import campaign_from_frames, prediction_frame, recording_frame
    from discovery.latex import latex_table
    from discovery.models import read_model, write_model
    from discovery.notebook import RunResults, run
    from discovery.recordings import load_campaign
    from discovery.report import write_report
    from discovery.sparse.library import FilteredInputs
    from discovery.sparse.optimiser import SparseSearch

_HOME = {
    "FilteredInputs": "sparse.library",
    "RunResults": "notebook",
    "SparseDiscovery": "estimator",
    "SparseSearch": "sparse.optimiser",
    "UserError": "errors",
    "campaign_from_frames": "frames",
    "diagnose": "diagnosis",
    "discover": "estimator",
    "fit_model": "fitting",
    "latex_table": "latex",
    "load_campaign": "recordings",
    "prediction_frame": "frames",
    "read_model": "models",
    "recording_frame": "frames",
    "run": "notebook",
    "write_model": "models",
    "write_report": "report",
}

__all__ = [
    "FilteredInputs",
    "RunResults",
    "SparseDiscovery",
    "SparseSearch",
    "UserError",
    "campaign_from_frames",
    "diagnose",
    "discover",
    "fit_model",
    "latex_table",
    "load_campaign",
    "prediction_frame",
    "read_model",
    "recording_frame",
    "run",
    "write_model",
    "write_report",
]


def __dir__() -> list[str]:
    return sorted({*__all__, "__version__"})


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        if name.startswith("_"):
            raise AttributeError(f"module 'discovery' has no attribute '{name}'")
        from discovery.schema import suggest

        raise AttributeError(f"module 'discovery' has no attribute '{name}'; {suggest(name, __all__)}")
    return getattr(import_module(f"discovery.{_HOME[name]}"), name)
