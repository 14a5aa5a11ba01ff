"""The form of an experiment file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag

from discovery.effects.own import EffectForm
from discovery.fitting.solve import Loss
from discovery.models.convection import Speeding
from discovery.schema import Strict, suggest
from discovery.sparse.options import SparseOptions
from discovery.targets import Target


def _file_name(name: str) -> str:
    if not re.fullmatch(r"\w[\w .+-]*", name):
        raise ValueError(f"'{name}' becomes the name of a file: use letters, digits, space, _ . + -")
    return name


def _one_line(name: str) -> str:
    if not (name.isprintable() and re.search(r"[^\W_]", name)):
        raise ValueError(f"{name!r}: write a name of one line, with letters or digits")
    return name


_BUILT = [
    "reduced",
    "superposition",
    "thermobalance",
    "sindy",
    "pysindy",
    "regression",
]  # kinds of models; one in a file needs no kind

# What several kinds of models may say
Inputs = Annotated[list[str] | None, Field(min_length=1, description="default by role, as in the paper")]
Outputs = Annotated[list[str] | None, Field(min_length=1, description="default: those of the experiment")]
Pull = Annotated[Loss, Field(description="how outliers pull")]
Also = Annotated[list[str], Field(description="recordings that this model is fitted to in addition to `fit`")]


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


class ThermobalanceEntry(Strict):
    """The five bodies of the rotary table, section 3, with the film coefficient of eqs. (1) to (6)."""

    kind: Literal["thermobalance"]
    fluid: bool = Field(True, description="whether cutting fluid wets Table and C-Body 1")
    speeding: Speeding = Field("none", description="eq. (6) off, as printed, or with the exponent 1.5")
    jet: bool = Field(False, description="find the exponents of nozzle height and fluid velocity in eq. (1)")
    outputs: Outputs = None
    also: Also = []
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
    """Say what a model is: a file, or a kind that is built."""
    if not isinstance(entry, Mapping):
        return entry
    if "kind" in entry and (kind := str(entry["kind"])) not in ("file", *_BUILT):
        raise ValueError(f'kind {kind!r} is not known; {suggest(kind, _BUILT)}, or file = "my_model.toml"')
    if not any(get_close_matches(key, ["kind", "file"]) for key in entry):
        raise ValueError(f'say file = "my_model.toml", or kind = one of {", ".join(_BUILT)}')
    return entry


def _kind(entry: Any) -> str:
    return str(entry.get("kind", "file") if isinstance(entry, Mapping) else getattr(entry, "kind", "file"))


ModelEntry = (
    FileEntry
    | ReducedEntry
    | SuperpositionEntry
    | ThermobalanceEntry
    | SparseOptions
    | PysindyEntry
    | RegressionEntry
)
TaggedEntry = Annotated[
    Annotated[FileEntry, Tag("file")]
    | Annotated[ReducedEntry, Tag("reduced")]
    | Annotated[SuperpositionEntry, Tag("superposition")]
    | Annotated[ThermobalanceEntry, Tag("thermobalance")]
    | Annotated[SparseOptions, Tag("sindy")]
    | Annotated[PysindyEntry, Tag("pysindy")]
    | Annotated[RegressionEntry, Tag("regression")],
    Discriminator(_kind),
    BeforeValidator(_said),
]


class MismatchForm(Strict):
    """[mismatch]: the model whose missing physics is looked for."""

    model: str
    effects: list[EffectForm] = Field([], description="effects of your own, in addition to the catalogue")


class ExportForm(Strict):
    """[export]: the model that goes to the machine, and the forms it takes."""

    model: str
    to: list[Target] = Field(["json"], min_length=1)


class PaperForm(Strict):
    """[paper]: which models and recordings play the parts of the paper; writes `paper.html`.

    What is not given is not shown. Recordings that only the page looks at need not stand in `fit` or
    `held_out`.
    """

    thermobalance: str = Field(description="model of section 3: table 1, figures 6 and 7, budgets")
    superposition: str = Field(description="model of eq. (8): table 3, figure 8")
    reduced: str = Field(description="model of eq. (9): table 3, figure 9")
    wet: str | None = Field(None, description="warm-up under cutting fluid, figure 3")
    dry: str | None = Field(None, description="the same warm-up without fluid, figure 3")
    compensated: list[str] = Field([], description="recordings replayed with active compensation")
    speeding: list[str] = Field([], description="models that differ in eq. (6) alone")
    dry_load: str | None = Field(None, description="eq. (8) with the load from a dry machine")
    cooling: str | None = Field(None, description="eq. (8) with the axis cooling power as u_2")
    nozzle: str | None = Field(None, description="recording in which height and flow of the jet matter")
    flooded: str | None = Field(None, description="recording in which they do not")
    symmetric: str | None = Field(None, description="error that symmetry keeps small, E_X0C")
    test_piece: list[str] = Field([], description="recordings of which few readings recalibrate the model")
    left_nozzle: str | None = Field(None, description="experiment that diagnoses the nozzle on the left")

    def recordings(self) -> list[tuple[str, str]]:
        """What it says of recordings: key and recording."""
        alone = [(key, getattr(self, key)) for key in ("wet", "dry", "nozzle", "flooded")]
        return [(key, name) for key, name in alone if name] + [
            (key, name) for key in ("compensated", "test_piece") for name in getattr(self, key)
        ]

    def models(self) -> list[tuple[str, str]]:
        """What it says of models: key and model."""
        keys = ("thermobalance", "superposition", "reduced", "dry_load", "cooling")
        alone = [(key, getattr(self, key)) for key in keys]
        return [(key, name) for key, name in alone if name] + [("speeding", name) for name in self.speeding]


class ExperimentForm(Strict):
    """The whole file."""

    name: Annotated[str, AfterValidator(_one_line)]
    campaign: str = Field(description="campaign file or its folder, relative to the experiment file")
    outputs: list[str] | None = Field(
        None,
        min_length=1,
        description="default: every channel of role error, else of role temperature; for a model file, also "
        "what else is measured that it gives",
    )
    fit: list[str] = Field(min_length=1, description="recordings that fits may see")
    held_out: list[str] = Field([], description="held-out recordings, which no fit and no choice uses")
    cross_validate: bool = Field(
        True, description="leave recordings and blocks out of the fit, one after the other"
    )
    roles: dict[str, Annotated[list[str], Field(min_length=1)]] | None = Field(
        None,
        min_length=2,
        description="part that recordings play -> recordings; each is left out in turn, models found anew",
    )
    models: dict[Annotated[str, AfterValidator(_file_name)], TaggedEntry] = Field(min_length=1)
    mismatch: MismatchForm | None = None
    export: ExportForm | None = None
    paper: PaperForm | None = None


def own_recordings(entry: ModelEntry) -> list[tuple[str, str]]:
    """Recordings that one model is fitted to, other than those common to all: word and recording."""
    alone = [("separate", name) for names in separate(entry).values() for name in names]
    return alone + [("also", name) for name in getattr(entry, "also", ())]


def separate(entry: ModelEntry) -> Mapping[str, list[str]]:
    """Input -> recordings of its own, where a superposition names them."""
    return (isinstance(entry, SuperpositionEntry) and entry.separate) or {}
