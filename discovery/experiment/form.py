"""The form of an experiment file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag

from discovery.effects.own import EffectForm
from discovery.fitting.solve import Loss
from discovery.schema import Strict, suggest
from discovery.sparse.options import SparseOptions
from discovery.targets import Target


def _file_name(name: str) -> str:
    if not re.fullmatch(r"\w[\w .+-]*", name):
        raise ValueError(f"'{name}' becomes the name of a file: use letters, digits, space, _ . + -")
    return name


_BUILT = [
    "reduced",
    "superposition",
    "sindy",
    "pysindy",
    "regression",
]  # kinds of models; one in a file needs no kind

# What several kinds of models may say
Inputs = Annotated[list[str] | None, Field(min_length=1, description="default by role, as in the paper")]
Outputs = Annotated[list[str] | None, Field(min_length=1, description="default: those of the experiment")]
Pull = Annotated[Loss, Field(description="how outliers pull")]
Also = Annotated[list[str], Field(description="recordings that this model is fitted to besides `fit`")]


class FileEntry(Strict):
    """A model that somebody wrote down."""

    kind: Literal["file"] = "file"
    file: str = Field(min_length=1, description="model file, relative to the experiment file")
    outputs: Outputs = None
    also: Also = []
    loss: Pull = "linear"


class ReducedEntry(Strict):
    """Equation (9)."""

    kind: Literal["reduced"]
    inputs: Inputs = None
    outputs: Outputs = None
    also: Also = []
    loss: Pull = "linear"


class SuperpositionEntry(Strict):
    """Equation (8), all influences together, or one after the other from recordings of their own."""

    kind: Literal["superposition"]
    inputs: Inputs = None
    outputs: Outputs = None
    separate: dict[str, Annotated[list[str], Field(min_length=1)]] | None = Field(
        None,
        min_length=1,
        description="input -> its recordings; fitted in this order, one input after the other",
    )
    loss: Pull = "linear"


class PysindyEntry(Strict):
    """PySINDy as its users take it, threshold by cross-validation."""

    kind: Literal["pysindy"]
    inputs: Inputs = None
    outputs: Outputs = None
    form: Literal["auto", "plain", "weak"] = Field(
        "auto", description='derivatives of readings, or integrals; "auto": what predicts left-out parts best'
    )
    also: Also = []


class RegressionEntry(Strict):
    """Ridge regression on the inputs, without memory."""

    kind: Literal["regression"]
    inputs: Inputs = None
    outputs: Outputs = None
    also: Also = []


def _said(entry: Any) -> Any:
    """What a model is: a file of its own, or a kind that is built."""
    if not isinstance(entry, Mapping):
        return entry
    if "kind" in entry and (kind := str(entry["kind"])) not in ("file", *_BUILT):
        raise ValueError(f'kind {kind!r} is not known; {suggest(kind, _BUILT)}, or file = "my_model.toml"')
    if not any(get_close_matches(key, ["kind", "file"]) for key in entry):
        raise ValueError(f'say file = "my_model.toml", or kind = one of {", ".join(_BUILT)}')
    return entry


def _kind(entry: Any) -> str:
    return str(entry.get("kind", "file") if isinstance(entry, Mapping) else getattr(entry, "kind", "file"))


ModelEntry = FileEntry | ReducedEntry | SuperpositionEntry | SparseOptions | PysindyEntry | RegressionEntry
TaggedEntry = Annotated[
    Annotated[FileEntry, Tag("file")]
    | Annotated[ReducedEntry, Tag("reduced")]
    | Annotated[SuperpositionEntry, Tag("superposition")]
    | Annotated[SparseOptions, Tag("sindy")]
    | Annotated[PysindyEntry, Tag("pysindy")]
    | Annotated[RegressionEntry, Tag("regression")],
    Discriminator(_kind),
    BeforeValidator(_said),
]


class MismatchForm(Strict):
    """[mismatch]: the model whose missing physics is looked for."""

    model: str
    effects: list[EffectForm] = Field([], description="effects of your own, beside the catalogue's")


class ExportForm(Strict):
    """[export]: the model that goes to the machine, and the forms it takes."""

    model: str
    to: list[Target] = Field(["json"], min_length=1)


class ExperimentForm(Strict):
    """The whole file."""

    name: Annotated[str, AfterValidator(_file_name)]
    campaign: str = Field(description="campaign file or its folder, relative to the experiment file")
    outputs: list[str] | None = Field(
        None,
        min_length=1,
        description="default: every channel of role error, else of role temperature",
    )
    fit: list[str] = Field(min_length=1, description="recordings that fits may see")
    held_out: list[str] = Field([], description="recordings that nothing sees before the end")
    cross_validate: bool = Field(
        True, description="leave recordings and blocks out of the fit, one after the other"
    )
    models: dict[Annotated[str, AfterValidator(_file_name)], TaggedEntry] = Field(min_length=1)
    mismatch: MismatchForm | None = None
    export: ExportForm | None = None


def own_recordings(entry: ModelEntry) -> list[tuple[str, str]]:
    """What a model says of recordings of its own, beside those that all are fitted to: word and recording."""
    alone = [("separate", name) for names in separate(entry).values() for name in names]
    return alone + [("also", name) for name in getattr(entry, "also", ())]


def separate(entry: ModelEntry) -> Mapping[str, list[str]]:
    """Input -> recordings of its own, where a superposition names them."""
    return (isinstance(entry, SuperpositionEntry) and entry.separate) or {}
