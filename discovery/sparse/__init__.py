"""Sparse discovery: the terms that recordings ask for, and no others.

Nothing is imported here: to read an experiment takes only `options`, and PySINDy takes a second to load.
"""
