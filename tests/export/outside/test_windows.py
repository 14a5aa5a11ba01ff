"""Binaries for Windows are inside the units, made by the cross compiler."""

from __future__ import annotations
