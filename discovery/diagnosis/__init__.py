"""Diagnosis: locate what a model leaves out, name it, model it and show the fit improve."""

from discovery.diagnosis.diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
