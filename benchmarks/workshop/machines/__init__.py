"""The machines, each in its file, and all their cases by name."""

from __future__ import annotations

from benchmarks.workshop.case import Case

from . import axis, battery, chiller, column, gearbox, laser, mould, robot, spindle, vacuum

MACHINES = (chiller, battery, gearbox, vacuum, column, spindle, mould, laser, axis, robot)
CASES: dict[str, Case] = {name: case for machine in MACHINES for name, case in machine.CASES.items()}
