"""Fitting: parameters of a model from several recordings at once, with reliable intervals."""

from discovery.fitting.fit import Fit, fit_model
from discovery.fitting.heldout import (
    from_known_starts,
    innovations_from_known_starts,
    predict_recording,
)
from discovery.fitting.noise import Noise
from discovery.fitting.problem import Prior, Problem, Unknown, make_problem

__all__ = [
    "Fit",
    "Noise",
    "Prior",
    "Problem",
    "Unknown",
    "fit_model",
    "from_known_starts",
    "innovations_from_known_starts",
    "make_problem",
    "predict_recording",
]
