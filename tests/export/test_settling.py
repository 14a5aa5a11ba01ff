"""How long a start lasts and how far an offset moves in a tick, on models whose time constants one knows."""

from __future__ import annotations

from dataclasses import replace

import pytest

from discovery.export.compiled import compile_model
from discovery.export.document import Exported
from discovery.export.settling import beginning, slowest_s
from discovery.models import Model, State
from discovery.runtime.compensator import Compensator
from discovery.runtime.guards import Reading
from discovery.terms import Term, parse
from tests.runtime.small import POWER, small


def two_masses(output: str) -> Exported:
    """A mass of 8 h that heats one of 1 h."""
    states = {name: State(name, "um", None, parse(0.0), 0.0, 1.0) for name in ("slow", "fast")}
    terms = (
        Term("drive", "slow", parse("P/1000 - slow/28800")),
        Term("follows", "fast", parse("(slow - fast)/3600")),
        Term("drives", "fast", parse("P/1000")),
    )
    model = Model("masses", {}, states, terms, {"E": parse(output)})
    return replace(small(), model=model, compiled=compile_model(model, 10.0), inputs=(POWER,))


def test_a_start_settles_after_three_of_the_slowest_time_constant() -> None:
    assert slowest_s(two_masses("fast")) == pytest.approx(28800.0)
    start, moves = beginning(two_masses("fast"))
    assert start.startswith(
        "a cold start settles after about 24 h, because the slowest time constant is 8 h; "
        "the state is COLD for 8 h"
    )
    assert "--state" in start
    assert moves == "in a tick of 10 s an offset moves by at most 10 um (E)"


def test_what_no_output_shows_is_not_waited_for() -> None:
    """What is left of the slow mass decays with 8 h, and an error of nothing but the power has no memory."""
    assert slowest_s(small("P/1000 - y/600")) == pytest.approx(600.0)
    assert slowest_s(two_masses("P/100")) == 0.0
    assert len(beginning(two_masses("P/100"))) == 1


def test_in_a_tick_an_offset_moves_as_far_as_said_also_at_the_start() -> None:
    """An error that follows the power at once: 2 um at the start. Its limit allows 0.5 um in a tick."""
    model = replace(small().model, outputs={"E": parse("P/400")})
    output = replace(small().outputs[0], range=replace(small().outputs[0].range, rate=0.05))
    direct = replace(small(), model=model, compiled=compile_model(model, 10.0), outputs=(output,))
    assert beginning(direct) == ["in a tick of 10 s an offset moves by at most 0.5 um (E)"]
    compensator = Compensator(direct)
    offsets = [compensator.tick({"P": Reading(800.0, 10.0 * k)}, 10.0 * k).offsets["E"] for k in range(6)]
    assert offsets == pytest.approx([0.0, -0.5, -1.0, -1.5, -2.0, -2.0])
