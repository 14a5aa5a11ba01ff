"""Sparse discovery: the terms that recordings ask for, and no others."""

from discovery.sparse.discover import discover
from discovery.sparse.discovery import Discovery, PathPoint
from discovery.sparse.options import SparseOptions

__all__ = ["Discovery", "PathPoint", "SparseOptions", "discover"]
