"""The form of diagnosis.json: what its parts hold, in which unit."""

from __future__ import annotations

from pydantic import Field

from discovery.schema import Strict

Number = float | None


class SizeRatio(Strict):
    """The ratio of a size that is not determined to another parameter: it is known."""

    to: str = Field(description="the other parameter")
    value: Number
    low: Number = Field(description="95 % interval")
    high: Number


class Size(Strict):
    """A parameter of an effect that was found."""

    value: Number
    low: Number = Field(description="95 % interval")
    high: Number
    unit: str
    at: str | None = Field(None, description="speed, or value of an input, that it is a size at")
    output: str | None = Field(None, description="output that it is a size of, where each has its own")
    ratio: SizeRatio | None = Field(None, description="what is known of a size that is not determined")


class Claim(Strict):
    """An effect at a place."""

    effect: str
    states: list[str] = Field(description="states it enters; for a measurement fault the output or input")
    recording: str | None = Field(None, description="the one in which it acts, or begins to act")
    lasts: bool = Field(default=False, description="whether it acts in all later recordings, too")
    grows: bool = Field(default=False, description="whether it grows by as much in each of them")
    channels: list[str] = Field(default_factory=list, description="inputs that it follows")


class Physics(Claim):
    """An effect that the repaired model adds."""

    title: str
    moved: list[str] | None = Field(None, description="outputs that it moves beyond the interval of each")
    probability: float
    together: float | None = Field(
        None,
        description="probability that it acts, or an alternative less than 3 below, where one is as near",
    )
    expression: str
    expressions: list[str] | None = Field(None, description="all, where it has several")
    parameters: dict[str, Size]
    source: str
    confused_with: list[str]


class Alternative(Claim):
    """Another answer to one part of the question."""

    log_evidence_below_best: float
    instead_of: str


class Considered(Claim):
    """A candidate effect of the first scan, scored on the residual of the baseline."""

    instants_s: list[float] | None = None
    log_evidence: Number
    log_odds: Number = Field(description="with the prior odds of its place")
    score: Number = Field(description="standard deviations")
    share_that_a_refit_leaves: Number


class OwnEffect(Claim):
    """An effect of the experiment file that was searched, at its likeliest place."""

    named: bool
    log_evidence: Number = Field(description="over the model without any effect, to first order")
    log_evidence_below_best: Number = Field(description="of the best refit with it; null if there is none")


class Detection(Strict):
    """Residual of the baseline, and the noise that it is compared with."""

    p_value: Number = Field(description="probability that nothing is missing")
    log_evidence: Number = Field(description="log posterior odds of the answer over the baseline")
    latent_force_log_evidence: Number
    noise: dict[str, Number]
    slow_noise: dict[str, Number]
    process_noise: dict[str, Number] = Field(description="floor at each state, W or a rate")
    form_error: float = Field(description="process noise as a share of what flows")
    residual_rms: dict[str, Number]


class Window(Strict):
    """A span in which heat is missing."""

    recording: str
    start_s: Number
    end_s: Number
    state: str
    heat_W: Number = Field(description="in the unit of `heat_units`")  # noqa: N815 - a name that is kept


class LocationDocument(Strict):
    """Where and when."""

    outputs: dict[str, float]
    states: dict[str, float]
    alike: list[list[str]] = Field(description="states at which missing heat looks the same in the readings")
    windows: list[Window]
    regime: str | None
    unmodelled_heat_W: dict[str, Number] = Field(description="rms, in the unit of `heat_units`")  # noqa: N815
    heat_units: dict[str, str] = Field(
        {}, description="by state: of heat_W and unmodelled_heat_W; a state without heat capacity has a rate"
    )


class Gain(Strict):
    """rms of free runs before and after the repair, in `unit` of the improvement."""

    rms_before: Number
    rms_after: Number
    noise_floor: Number
    expected: Number = Field(default=None, description="noise floor and the uncertainty of the parameters")
    gain_low: Number = None
    gain_high: Number = None
    outputs: dict[str, tuple[Number, Number]] = Field(
        default_factory=dict, description="rms of each output before and after, in its unit"
    )
    from_known_starts: tuple[Number, Number] | None = Field(
        default=None,
        description="rms before and after from the starts that all readings show: these decide",
    )
    runs_away: bool | None = None


class ImprovementDocument(Strict):
    """The proof."""

    unit: str
    fit: Gain
    held_out: dict[str, Gain]
    contradicted_by: list[str]
    explained: Number = Field(description="share of the closable mismatch, of the rms from known starts")


class WrongReading(Strict):
    """A single reading that was set aside."""

    output: str
    recording: str
    time_s: Number
    size: Number


class HungSensor(Strict):
    """A sensor that hung: it repeats `value` for so many `readings`. All but the first are set aside."""

    output: str
    recording: str
    start_s: Number
    end_s: Number
    value: Number
    readings: int


class Against(Strict):
    """Missing heat against one input or state."""

    value: list[Number]
    heat: list[Number]
    error: list[Number]


class MissingHeat(Strict):
    """The latent force at the most likely state."""

    state: str
    over_time: dict[str, dict[str, list[float]]]
    against: dict[str, Against]
    named: bool


class DescriptionDocument(Strict):
    """A formula that follows heat of unknown cause."""

    state: str
    formula: str
    log_evidence: Number
    note: str = "describes the missing heat; it is not its cause"


class ResponsePart(Strict):
    """An output follows an input with a gain, after a time constant."""

    input: str
    gain: Number
    unit: str
    time_constant_s: Number
    low_s: Number = Field(description="the shortest over the fits without a recording")
    high_s: Number = Field(description="the longest over them")


class ResponseDocument(Strict):
    """How an output follows inputs, as a sum of lags that is found without the model."""

    output: str
    unit: str
    parts: list[ResponsePart]
    rms_left_out: Number = Field(description="on recordings that are left out of the fit in turn")
    rms_of_model: Number = Field(description="of the model on the same recordings, left out of its fit, too")
    sentence: str
    note: str = "describes the readings; it is not the cause of what is missing"


class DiagnosisDocument(Strict):
    """The content of diagnosis.json."""

    model: str
    verdict: str
    reasons: list[str]
    about: str
    detection: Detection
    location: LocationDocument
    physics: list[Physics]
    alternatives: list[Alternative]
    considered: list[Considered]
    closest: list[Claim]
    own_effects: list[OwnEffect] = Field(
        default_factory=list, description="effects of the experiment file that have a place in the model"
    )
    improvement: ImprovementDocument
    set_aside: list[WrongReading]
    hung: list[HungSensor] = Field(default_factory=list, description="sensors that hung")
    missing_heat: MissingHeat | None
    description: DescriptionDocument | None
    responses: list[ResponseDocument] = Field(
        default_factory=list, description="of a mismatch without a name: where a short sum beats the model"
    )
    next_experiment: str
    seconds: float
