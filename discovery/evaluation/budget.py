"""Energy and fluid budget of a recording, as a fitted thermal model sees it.

    sum over terms of  integral Q dt  =  sum over bodies of  C (T_end - T_start)

Terms that only move heat between bodies appear in both sums and cancel; they are listed by the heat moved. A
budget that does not close says that the integration, not the machine, is at fault: the terms are integrated
along the trajectory by the trapezoidal rule, the states by the model's own integrator.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.models.convection import HEAT_OF_FLUID
from discovery.recordings import Campaign, Channel, Recording
from discovery.recordings.correction import at_every_row
from discovery.terms import evaluate, names

Array = NDArray[np.float64]
MJ = 1e6
LITRE = 1e-3  # m3


@dataclass(frozen=True)
class Budget:
    """Heat in MJ over one recording.

    `entering`: by term, into the bodies from outside (negative: it leaves). `moved`: by term, from one body
    into another. `stored`: by body. `fluid`: by name, see `fluid_budget`; empty without cutting fluid.
    """

    entering: Mapping[str, float]
    moved: Mapping[str, float]
    stored: Mapping[str, float]
    fluid: Mapping[str, float]

    @property
    def gap(self) -> float:
        """What entered and is not stored [MJ]: 0 but for the integration."""
        return sum(self.entering.values()) - sum(self.stored.values())


def budget(trajectory: Trajectory, campaign: Campaign) -> Budget | None:
    """The budget of a free run; None for a model without heat capacities.

    Args:
        trajectory: of a model whose terms are heat flows in W.
        campaign: holds the recording; channels are known by their roles.
    """
    system = trajectory.system
    bodies = {name: state.capacity for name, state in system.model.states.items() if state.capacity}
    if not bodies:
        return None
    env, steps = trajectory.at_ends(), system.grid.step
    entering: dict[str, float] = {}
    moved: dict[str, float] = {}
    wet = 0.0
    fluids = {name for name, c in campaign.channels.items() if c.role == "fluid temperature"}
    for term in system.model.terms:
        if term.into not in bodies and term.source not in bodies:
            continue
        flow = np.broadcast_to(
            evaluate(term.expression, env, frozenset(), system.ends).value, (2 * len(steps),)
        )
        heat = float(np.sum(0.5 * (flow[0::2] + flow[1::2]) * steps)) / MJ
        inside = term.into in bodies and term.source in bodies
        into = moved if inside else entering
        sign = 1.0 if term.into in bodies else -1.0
        into[term.name] = into.get(term.name, 0.0) + sign * heat
        wet += sign * heat if not inside and names(term.expression) & fluids else 0.0
    first, last = trajectory.x[0], trajectory.x[-1]
    stored = {
        name: capacity * float(last[k] - first[k]) / MJ
        for k, name in enumerate(system.states)
        if (capacity := bodies.get(name))
    }
    recording = campaign.recordings[system.grid.recording]
    return Budget(entering, moved, stored, fluid_budget(recording, campaign.channels, wet))


def fluid_budget(recording: Recording, channels: Mapping[str, Channel], heat_MJ: float) -> dict[str, float]:
    """What the cutting fluid did: hours pumped, volume, temperature over the room, heat given to the machine,
    and the temperature drop of the fluid that this heat makes (only where a flow in l/min is recorded).

        drop = Q/(rho c V)

    Args:
        heat_MJ: given to the machine by terms that contain the fluid temperature.
    """
    by_role: dict[str, list[str]] = {}
    for name, channel in channels.items():
        values = recording.values.get(name)
        if values is not None and np.isfinite(values).any():
            by_role.setdefault(channel.role, []).append(name)
    flows = by_role.get("fluid flow", [])
    if not flows or "fluid temperature" not in by_role:
        return {}
    steps = np.diff(recording.time)

    def over(name: str) -> Array:
        """A channel in each interval between rows; 0 before it is known."""
        rows = at_every_row(recording.time, recording.values[name], channels[name].between)
        middle = 0.5 * (rows[:-1] + rows[1:]) if channels[name].between == "linear" else rows[:-1]
        return np.nan_to_num(middle)

    on = (over(flows[0]) > 0) * steps
    found = {"hours pumped": float(np.sum(on)) / 3600.0, "heat to the machine [MJ]": heat_MJ}
    if not np.sum(on) > 0:
        return found
    if rooms := by_role.get("ambient temperature"):
        above = over(by_role["fluid temperature"][0]) - over(rooms[0])
        found["over the room [K]"] = float(np.sum(above * on) / np.sum(on))
    if litres := [n for n in flows if channels[n].unit == "l/min"]:
        volume = float(np.sum(over(litres[0]) * steps)) / 60.0 * LITRE
        found["volume [m3]"] = volume
        found["drop of the fluid [K]"] = heat_MJ * MJ / (HEAT_OF_FLUID * volume)
    return found
