"""Dynamics: trajectories and the sensitivities of all parameters and candidate terms, with one kernel."""

from discovery.dynamics.grid import Grid, make_grid
from discovery.dynamics.sensitivity import Column, sensitivities
from discovery.dynamics.system import (
    System,
    Trajectory,
    make_system,
    outputs,
    simulate,
    start_values,
)

__all__ = [
    "Column",
    "Grid",
    "System",
    "Trajectory",
    "make_grid",
    "make_system",
    "outputs",
    "sensitivities",
    "simulate",
    "start_values",
]
