"""Mismatch: locate what a model leaves out, name it, model it and show the fit improve."""

from discovery.mismatch.diagnosis import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
