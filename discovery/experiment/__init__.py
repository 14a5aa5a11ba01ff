"""Experiment: its file, the run that ties every stage together, and the results that it leaves behind."""

from discovery.experiment.experiment import Experiment, load_experiment
from discovery.experiment.pipeline import diagnose, run

__all__ = ["Experiment", "diagnose", "load_experiment", "run"]
