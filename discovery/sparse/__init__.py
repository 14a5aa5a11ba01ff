"""Sparse discovery: the few terms that the recordings support.

Nothing is imported here: reading an experiment needs only `options`, and PySINDy takes a second to load.
"""
