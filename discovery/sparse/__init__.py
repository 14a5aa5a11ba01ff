"""Sparse discovery: the few terms that the recordings support.

Nothing is imported here: to read an experiment takes only `options`, and PySINDy takes a second to load.
"""
