"""Evaluation: the paper's criteria, its tables, and cross-validation over the recordings to fit."""

from discovery.evaluation.criteria import Criteria, criteria, evaluate, improvement

__all__ = ["Criteria", "criteria", "evaluate", "improvement"]
