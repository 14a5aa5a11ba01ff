"""Export: a fitted model becomes one sealed document and, from it, code for controllers and simulators."""

from discovery.export.document import Exported, read_document
from discovery.export.export import Export, export_document, export_model, export_run
from discovery.export.stepper import Stepper

__all__ = ["Export", "Exported", "Stepper", "export_document", "export_model", "export_run", "read_document"]
