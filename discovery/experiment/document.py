"""results.json: its schema. Numbers have six significant digits; what is none is null."""

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
    noise: dict[str, Number] = Field(description="reading noise of each output that the fit reckoned with")
    notes: list[str]
    search: dict[str, Any] | None = Field(None, description="what a search for terms reports")


class ResultsDocument(Strict):
    """The content of results.json."""

    experiment: str
    command: str
    campaign: str
    campaign_file: str
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
    guessed: dict[str, str] | None = Field(None, description="of channels, what nobody has confirmed")
    models: dict[str, ModelResults]
    recommended: dict[str, dict[str, Any]] | None = Field(
        None, description="by output: the model that is best on held-out recordings, and how far others are"
    )
    seconds: float
    versions: dict[str, str]
    inputs: dict[str, str] = Field(description="SHA-256 of each file that was read")
