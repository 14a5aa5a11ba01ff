"""Models: hand-built and discovered ones meet here as the same sparse sum of terms."""

from discovery.models.model import Model, Parameter, State, expanded

__all__ = ["Model", "Parameter", "State", "expanded"]
