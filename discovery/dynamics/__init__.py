"""Dynamics: trajectories and the sensitivities of all parameters and candidate terms, with one kernel."""

from discovery.dynamics.grid import Grid, make_grid
from discovery.dynamics.prediction import outputs, predict
from discovery.dynamics.room import keep_room
from discovery.dynamics.sensitivity import Column, sensitivities
from discovery.dynamics.starts import at_rest, start_values
from discovery.dynamics.system import System, make_system
from discovery.dynamics.trajectory import Trajectory, simulate

keep_room()

__all__ = [
    "Column",
    "Grid",
    "System",
    "Trajectory",
    "at_rest",
    "make_grid",
    "make_system",
    "outputs",
    "predict",
    "sensitivities",
    "simulate",
    "start_values",
]
