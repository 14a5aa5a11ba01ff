"""Models: hand-built and discovered ones meet here as the same sparse sum of terms."""

from discovery.models.check import check_model
from discovery.models.model import Model, Parameter, State, expanded
from discovery.models.modelfile import model_document, read_model, write_model

__all__ = [
    "Model",
    "Parameter",
    "State",
    "check_model",
    "expanded",
    "model_document",
    "read_model",
    "write_model",
]
