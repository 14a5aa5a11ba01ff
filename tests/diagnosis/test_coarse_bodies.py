"""A body that is modelled badly does not hide what another body lacks."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis import diagnose
from discovery.diagnosis.coarse_bodies import judging
from discovery.diagnosis.context import Context
from discovery.diagnosis.diagnose import Diagnosis
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
STEP, MINUTES, WILD = 120.0, 20.0, 0.4  # s; share by which the heat of the motor is off, and for how long
CAPACITY, AIR, LINK = (20000.0, 20000.0), (4.0, 3.0), 0.3  # J/K, W/K
LAMP = 0.6  # of the power of a lamp heats the plate; the model does not know


def levels(rng: np.random.Generator, values: Sequence[float], count: int) -> Array:
    """Steps of 40 to 120 min."""
    lengths = rng.integers(20, 60, count)
    return np.repeat(rng.choice(values, count), lengths)[:count]


def recorded(seed: int) -> Recording:
    """12 h of a motor, whose heat wanders, and of a plate, read every 2 min to 0.05 K."""
    rng = np.random.default_rng(seed)
    count = 360
    power, own, lamp = (levels(rng, v, count) for v in ([0, 100, 200, 300], [0, 40, 80], [0, 0, 30, 60]))
    off = np.zeros(count)
    off[0] = rng.standard_normal()
    kept = np.exp(-STEP / (60.0 * MINUTES))
    for k in range(1, count):
        off[k] = kept * off[k - 1] + np.sqrt(1 - kept**2) * rng.standard_normal()
    x: Array = np.full((count, 2), 21.0)
    for k in range(count - 1):
        motor, plate = x[k]
        flow = LINK * (motor - plate)
        heat = power[k] * (1 + WILD * off[k]) - AIR[0] * (motor - 21.0) - flow
        x[k + 1, 0] = motor + STEP * heat / CAPACITY[0]
        heat = own[k] + LAMP * lamp[k] - AIR[1] * (plate - 21.0) + flow
        x[k + 1, 1] = plate + STEP * heat / CAPACITY[1]
    read = x + 0.05 * rng.standard_normal(x.shape)
    inputs = {"P": power, "Q": own, "lamp": lamp, "room": np.full(count, 21.0)}
    return Recording(
        f"r{seed}", STEP * np.arange(float(count)), {**inputs, "motor": read[:, 0], "plate": read[:, 1]}
    )


def diagnosed() -> Diagnosis:
    """The diagnosis of a model without the lamp."""
    channels = {n: Channel(n, "heat load", "W", None, "held") for n in ("P", "Q", "lamp")}
    channels["room"] = Channel("room", "ambient temperature", "degC", None, "linear")
    channels |= {n: Channel(n, "temperature", "degC", 0.05, "linear") for n in ("motor", "plate")}
    seen = Campaign("rig", channels, {r.name: r for r in map(recorded, (1, 2, 3))})
    terms = (
        Term("heat of the motor", "motor", parse("eP*P")),
        Term("heat of the plate", "plate", parse("eQ*Q")),
        Term("link", "plate", parse("G*(motor - plate)"), "motor"),
        Term("air at the motor", "motor", parse("h1*(room - motor)")),
        Term("air at the plate", "plate", parse("h2*(room - plate)")),
    )
    sizes = {"eP": (1.0, "1"), "eQ": (1.0, "1"), "G": (2.0, "W/K"), "h1": (4.0, "W/K"), "h2": (3.0, "W/K")}
    parameters = {name: Parameter(value, unit, 0.0) for name, (value, unit) in sizes.items()}
    capacity = dict(zip(("motor", "plate"), CAPACITY, strict=True))
    states = {n: State(n, "degC", c, parse("room"), 0.3, 1 / c) for n, c in capacity.items()}
    return diagnose(Model("rig", parameters, states, terms, {}), seen, ["r1", "r2"], ["r3"])


def test_what_one_body_lacks_is_named_next_to_a_coarse_one() -> None:
    found = diagnosed()
    assert found.context.settings.coarser == ("motor",)
    assert found.verdict.answer.noise.share < WILD / 2
    (lamp,) = [n.hypothesis for n in found.verdict.named if n.hypothesis.effect.word == "input_heat"]
    assert (lamp.states, lamp.channels) == (("plate",), ("lamp",))
    low, high = found.interval(lamp, lamp.amplitudes[0])
    assert low is not None
    assert high is not None
    assert low < LAMP * 60.0 < high
    shares = re.findall(r"flows at motor are wrong by about (\d+) %", " ".join(found.verdict.reasons))
    assert shares in (["25"], ["80"])  # the steps of the grid next to 40 % are as likely as each other


def test_with_one_share_for_all_bodies_it_is_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    def alike(context: Context, _: Scored) -> Context:
        return context

    monkeypatch.setattr(sys.modules[Diagnosis.__module__], "with_coarse_bodies", alike)
    assert "input_heat" not in {n.hypothesis.effect.word for n in diagnosed().verdict.named}


def test_a_lag_of_a_coarse_body_is_judged_by_what_it_shows() -> None:
    """Its thermometer shows nothing else, and takes no part where a lag of the plate is judged."""
    shown = {"motor": parse("motor"), "plate": parse("plate")}
    context = cast(Context, SimpleNamespace(outputs=("motor", "plate"), model=SimpleNamespace(outputs=shown)))
    noise = SimpleNamespace(share=0.02, force={"motor": (1.0, 0.25), "plate": (1.0, 0.02)})
    setting = SimpleNamespace(level=1.0, levels={"motor": 2.0})
    answer = cast(Scored, SimpleNamespace(noise=noise, setting=setting))

    def lag(output: str) -> Hypothesis:
        return cast(Hypothesis, SimpleNamespace(states=(), shown={output: parse("0")}))

    assert judging(context, answer, [lag("plate")]) == [1]
    assert judging(context, answer, [lag("motor")]) == [0, 1]
