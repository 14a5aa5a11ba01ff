"""Discovery workbench: models of thermal errors from recordings, and what physics they miss.

Nothing heavy is imported here: ``import discovery`` takes a few milliseconds.
"""

__version__ = "0.1.0"
