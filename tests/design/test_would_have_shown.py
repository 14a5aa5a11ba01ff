"""What recordings without a mismatch would have shown: sizes that are worth saying."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np

from discovery.design.question import _smallest
from discovery.diagnosis.selection import Search
from discovery.evidence.bayes import Score, Slab
from discovery.models import Model
from discovery.terms import parse
from tests import machine
from tests.machine import SEEN, model


def search(*claims: Score, usual: float = 30.0) -> Search:
    """A search that made these claims, of effects with a usual size."""
    slab = Slab(np.array([usual]), np.array([3.0]), np.array([0.0]))
    context = SimpleNamespace(slab=lambda _: slab)
    return cast(Search, SimpleNamespace(claims=claims, context=context))


def test_a_size_without_a_unit_is_a_share() -> None:
    """Of a model whose states are the errors, a second mass is a share of an error."""
    errors = Model("errors", {}, {}, (), {name: parse("0.01*P_drive") for name in SEEN})
    h = next(h for h in machine.claims(errors, "second_time_constant") if "E_Z" in h.shown)
    seen = Score(h, 0.0, 2.0, (0.124,), 1.0, 0)
    said = _smallest(search(seen))
    assert said == "these recordings would have shown second_thermal_mass of 28 % at E_Z"
    whole = replace(h.effect, amplitude=replace(h.effect.amplitude, most=1.0))
    blind = Score(replace(h, effect=whole), 0.0, 2.0, (0.5,), 1.0, 0)  # it would have to be 113 %
    assert "second_thermal_mass" not in _smallest(search(blind))


def test_a_group_is_not_said_again_where_each_of_its_bodies_is() -> None:
    motor, table, bed = machine.claims(model(), "friction_speed")
    both = replace(motor, states=("motor", "table"))
    unseen = Score(bed, 0.0, 0.0, (9.0,), 1.0, 0)
    for shown, where in (
        ((motor, table, both), "at motor; table"),
        ((motor, both), "at motor; motor and table"),
    ):
        claims = [*(Score(h, 0.0, 2.0, (9.0,), 1.0, 0) for h in shown), unseen]
        assert _smallest(search(*claims)).endswith(where)


def test_a_size_far_beyond_a_usual_one_is_not_said() -> None:
    """A body that never moved shows a second mass of 4.3e12 1/s, that is none."""
    h = machine.claims(model(), "second_thermal_mass")[0]
    said = [_smallest(search(Score(h, 0.0, 1.0, (size,), 1.0, 0))) for size in (100.0, 1e12)]
    assert said[0].startswith("these recordings would have shown second_thermal_mass of 450 W/K at ")
    assert said[1].startswith("record longer and move the inputs more")
