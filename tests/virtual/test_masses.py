"""Second masses of the plant, at the body where a lumped model shows them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.models import Parameter
from discovery.terms import Term, parse
from discovery.virtual.families import FAMILIES
from discovery.virtual.masses import hidden_masses
from discovery.virtual.refit import refit
from discovery.virtual.world import FIT, World, draw_world


@pytest.fixture(scope="module")
def rig() -> World:
    return draw_world(np.random.default_rng(3), FAMILIES["bearing_rig"], coloured=False)


def left_with_mass_at(world: World, body: str, seconds: float) -> float:
    """Rms over noise that a full refit leaves with a second mass at a body."""
    machine = world.machine
    term = Term("mass", body, parse(f"G*(lag({body}, t) - {body})"))
    two = {"G": Parameter(1.0, "W/K", 0.0), "t": Parameter(seconds, "s", 1.0)}
    model = machine.baseline.with_terms(term, parameters=two)
    richer = replace(machine, baseline=model, nominal={**machine.nominal, "G": 1.0, "t": seconds})
    return refit(richer, world.logs(machine, FIT), world.sigma).rms


def test_the_inside_of_the_housing_shows_behind_the_ring_that_it_holds(rig: World) -> None:
    """The housing has four cells, and the outer ring sits in some. A full refit says where it helps."""
    found = hidden_masses(rig.machine, rig.fitted, rig.logs(rig.machine, FIT))
    assert "outer" in found
    assert "housing" not in found
    helped = np.sqrt(rig.fitted.rms**2 - left_with_mass_at(rig, "outer", 100.0) ** 2)
    assert found["outer"] == pytest.approx(helped, rel=0.3)  # to first order
    assert left_with_mass_at(rig, "housing", 600.0) > 0.95 * rig.fitted.rms


def test_what_helps_little_is_not_listed(rig: World) -> None:
    found = hidden_masses(rig.machine, rig.fitted, rig.logs(rig.machine, FIT))
    assert min(found.values()) ** 2 >= 0.5 * max(found.values()) ** 2
    assert ("second_thermal_mass", ("outer",), found["outer"]) in rig.lacks
