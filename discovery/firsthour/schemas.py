"""JSON schemas: of the files that a user writes, for an editor, and of those that a run leaves behind."""

from __future__ import annotations

import json
from typing import Any

from discovery.errors import UsageError
from discovery.schema import suggest

FILES = ("campaign", "model", "experiment", "results", "diagnosis")


def schema(file: str) -> str:
    """JSON schema (draft 2020-12) of a campaign, model or experiment file, of results.json or diagnosis.json.

    Raises:
        UsageError: another word.
    """
    from pydantic import BaseModel

    from discovery.diagnosis.form import DiagnosisDocument
    from discovery.experiment.document import ResultsDocument
    from discovery.experiment.form import ExperimentForm
    from discovery.models.modelfile import ModelForm
    from discovery.recordings.campaignfile import CampaignForm

    forms: dict[str, type[BaseModel]] = {
        "campaign": CampaignForm,
        "model": ModelForm,
        "experiment": ExperimentForm,
        "results": ResultsDocument,
        "diagnosis": DiagnosisDocument,
    }
    if file not in forms:
        raise UsageError(f"there is no schema of '{file}'; {suggest(file, list(FILES))}")
    document: dict[str, Any] = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    document |= forms[file].model_json_schema(by_alias=True)
    document["title"] = f"{file} file of the discovery workbench"
    return json.dumps(_plain(document), indent=1, ensure_ascii=False)


def _plain(value: Any) -> Any:
    """Infinite defaults, which JSON does not have, are left out."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items() if item not in (float("inf"), float("-inf"))}
    return [_plain(item) for item in value] if isinstance(value, list) else value
