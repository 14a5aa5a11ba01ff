"""Diagnosis: find where a model lacks physics, name the effect, add it, and test the repaired model."""

from discovery.diagnosis.diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
