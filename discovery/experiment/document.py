"""results.json: its schema. Numbers have six significant digits; a missing one is null."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from discovery.schema import Strict

Number = float | None


class Measures(Strict):
    """Criteria of an error, in its unit (variance: unit squared), or improvements of them in percent."""

    rms: Number
    peak: Number = Field(description="largest magnitude")
    mean: Number
    variance: Number = Field(description="about the mean")


class Scores(Measures):
    """What a model leaves of an output on a recording, in a free run."""

    r2: Number = Field(description="share of the variance that is explained")
    uncompensated: Measures
    improvement: Measures


class Estimate(Strict):
    """A parameter of a fitted model."""

    value: Number
    low: Number = Field(description="95 % interval")
    high: Number
    unit: str
    fixed: bool | None = None
    recordings: dict[str, Number] | None = Field(None, description="its value in each, where it has several")
    intervals: dict[str, list[Number]] | None = Field(None, description="its 95 % interval in each")


class Budgets(Strict):
    """Energy and fluid budget of a model on a recording, MJ."""

    entering: dict[str, Number] = Field(description="heat into the bodies from outside, by term")
    moved: dict[str, Number] = Field(description="heat from body to body, by term")
    stored: dict[str, Number] = Field(description="by body")
    fluid: dict[str, Number] = Field(description="what the cutting fluid did")
    gap: Number = Field(description="entered and not stored: 0 but for the integration")


class Spread(Strict):
    """A parameter over the folds that hold its term."""

    mean: Number
    sd: Number
    without: dict[str, Number] = Field(description="its value, by the role that was left out")


class Steadiness(Strict):
    """A term over the folds."""

    share: Number = Field(description="of the folds that hold it")
    parameters: dict[str, Spread]


class ModelFolds(Strict):
    """One model, found anew without each role."""

    rms: dict[str, dict[str, dict[str, Number]]] = Field(
        description="by error, role left out, role judged on"
    )
    terms: dict[str, Steadiness]
    unseen: dict[str, list[str]] = Field(
        description="by role left out, the roles of which it saw no recording"
    )
    lost: list[str] = Field(description="what went wrong")


class RoleMatrix(Strict):
    """Cross-validation over roles."""

    recordings: dict[str, list[str]] = Field(description="of each role")
    models: dict[str, ModelFolds]


class PaperTable(Strict):
    """A table of the page on the paper."""

    title: str
    header: list[str]
    rows: list[list[str | Number]]


class PaperChapter(Strict):
    """A figure, table or equation of the paper."""

    title: str
    shows: list[str]
    does_not_show: list[str]
    tables: list[PaperTable]
    failed: str | None = Field(None, description="why it could not be made")


class ModelResults(Strict):
    """One model."""

    kind: str
    terms: int
    parameters: int = Field(description="how many were fitted")
    seconds: float
    equations: list[str]
    shares: dict[str, Number] = Field(description="of each term in what moves the outputs")
    recordings: dict[str, dict[str, Scores]] = Field(description="by recording and output")
    cross_validation: dict[str, dict[str, Number]] = Field(description="rms where the fit has not been")
    values: dict[str, Estimate]
    noise: dict[str, Number] = Field(description="reading noise of each output that the fit used")
    notes: list[str]
    budgets: dict[str, Budgets] | None = Field(
        None, description="by recording, of a model with heat capacities"
    )
    search: dict[str, Any] | None = Field(None, description="what a search for terms reports")


class Recommended(Strict):
    """The model that is best for an output on the held-out recordings."""

    model: str
    rms: Number
    ties: list[str] = Field(description="models that the readings do not separate from it")
    against: dict[str, dict[str, Any]] = Field(description="by model, by how much it is worse")


class ResultsDocument(Strict):
    """The content of results.json."""

    experiment: str
    command: str
    campaign: str
    campaign_file: str
    simulated: bool | None = Field(None, description="whether the recordings come from a simulation")
    fit: list[str]
    held_out: list[str]
    outputs: list[str]
    units: dict[str, str]
    input_units: dict[str, str]
    roles: dict[str, str] | None = Field(None, description="role of each output")
    noise: dict[str, Number] = Field(description="reading noise that the campaign states")
    parts: dict[str, str] = Field(description="which recording plays which part of the paper")
    notes: dict[str, str]
    findings: list[str] = Field(description="what is wrong with the recordings")
    guessed: dict[str, str] | None = Field(None, description="by channel, guesses that were not confirmed")
    models: dict[str, ModelResults]
    recommended: dict[str, Recommended] | None = Field(None, description="by output")
    role_matrix: RoleMatrix | None = Field(None, description="each role left out of fit and search in turn")
    paper: dict[str, PaperChapter] | None = Field(None, description="what paper.html shows, by chapter")
    seconds: float
    versions: dict[str, str]
    inputs: dict[str, str] = Field(description="SHA-256 of each file that was read")
