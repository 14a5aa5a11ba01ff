"""The second law: no exchange takes heat from cold to warm."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from discovery.diagnosis.uphill import goes_uphill
from discovery.dynamics import make_system, simulate
from discovery.models import Parameter
from discovery.terms import Term, parse
from tests.effects.sample import sample, trajectory


@pytest.mark.parametrize("with_air", [False, True])
@pytest.mark.parametrize(
    ("size", "high", "uphill"),
    [(-5.0, -4.0, False), (-25.0, -18.0, True), (-25.0, -9.0, False), (25.0, 30.0, False)],
)
def test_an_exchange_may_become_smaller_and_not_negative(
    size: float, high: float, uphill: bool, with_air: bool
) -> None:
    """An exchange of 10 W/K of the model, of two bodies or with the air, and a further one of a size in W/K,
    known up to a largest one (95 %).
    """
    run = trajectory(sample()[0])
    a, b = [n for n, s in run.system.model.states.items() if s.capacity][:2]
    source, other = (None, "room") if with_air else (b, b)
    own = Term("own", a, parse(f"10*({other} - {a})"), source)
    more = Term("more", a, parse(f"G_more*({other} - {a})"), source)
    at_a = [t for t in run.system.model.terms if a in (t.into, t.source)]
    others = tuple(t for t in run.system.model.terms if t not in at_a)
    parameters = {**run.system.model.parameters, "G_more": Parameter(size, "W/K", high=high)}
    model = replace(run.system.model, terms=(*others, own, more), parameters=parameters)
    found = simulate(make_system(model, run.system.grid), {**run.values, "G_more": size})
    effect = SimpleNamespace(amplitude=SimpleNamespace(unit="W/K"))
    h = SimpleNamespace(
        effect=effect, states=(a,) if with_air else (a, b), terms=(more,), amplitudes=("G_more",)
    )
    fit = SimpleNamespace(model=SimpleNamespace(parameters=parameters), trajectories=(found,))
    assert goes_uphill(cast(Any, [h]), cast(Any, fit)) is uphill
