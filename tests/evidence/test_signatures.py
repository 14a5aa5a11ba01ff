"""Signatures: what a unit of an effect adds to the readings, against differences and against scipy."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.dynamics import make_grid, make_system, predict, simulate
from discovery.effects.candidates import candidates
from discovery.effects.catalogue import Effect, catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.scene import Scene
from discovery.evidence.signatures import signatures
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests import machine
from tests.effects.sample import expand, inside, machine_for, sample, trajectory


def _times(h: Hypothesis) -> dict[str, float]:
    return {name: value for name, value in h.shapes.items() if name.startswith("t_")}


@pytest.mark.parametrize("effect", catalogue().values(), ids=list(catalogue()))
def test_signatures_equal_differences(effect: Effect) -> None:
    """Every effect at every place and shape, against a central difference of the extended model."""
    baseline = machine_for(effect)
    # a lag as short as the steps of the inputs is resolved by neither
    found = [inside(h) for h in expand(effect) if not any(0 < v < 100 for v in _times(h).values())]
    columns = signatures(trajectory(baseline), found)
    step = 1e-4 * (effect.amplitude.plausible if effect.amplitude.fixed is None else 1.0)
    column = 0
    for h in found:
        for name in h.amplitudes:
            moved = []
            for sign in (1.0, -1.0):
                start = dict.fromkeys(h.amplitudes, 0.0) | {name: sign * step}
                moved.append(predict(trajectory(h.added_to(baseline, start))))
            expected = (moved[0] - moved[1]) / (2 * step)
            scale = np.abs(expected).max() + 1e-9
            assert np.abs(columns[:, :, column] - expected).max() < 5e-3 * scale, (h.key, h.shapes)
            column += 1


def test_a_signature_is_what_scipy_sees() -> None:
    """Fluid on the motor, and a path from motor to bed: a little of each in another integrator."""

    def fluid(_: float, x: machine.Array, u: machine.Inputs) -> tuple[float, float, float]:
        return (0.01 * u["pump"] * (u["T_fluid"] - x[0]), 0.0, 0.0)

    def path(_: float, x: machine.Array, __: machine.Inputs) -> tuple[float, float, float]:
        return (0.01 * (x[2] - x[0]), 0.0, -0.01 * (x[2] - x[0]))

    runs = [machine.simulated(1, noise=0.0, concealed=c) for c in (None, fluid, path)]
    truth = machine.model().with_values(machine.SIZES)
    campaign = machine.campaign(runs[0])
    grid = make_grid(campaign, "r1", machine.INPUTS, tuple(machine.SEEN))
    found = machine.claims(truth, "fluid_convection", "conduction_path", recordings=["r1"])
    places = [("motor",), ("motor", "bed")]
    chosen = [h for place in places for h in found if h.states == place]
    columns = signatures(simulate(make_system(truth, grid), truth.values()), chosen)
    for k, r in enumerate(runs[1:]):
        seen = [r.values[n] - runs[0].values[n] for n in machine.SEEN]
        expected = np.column_stack([y[np.isfinite(y)] for y in seen]) / 0.01
        assert np.abs(columns[:, :, k] - expected).max() < 0.01 * np.abs(expected).max()


def test_what_belongs_to_another_recording_is_zero() -> None:
    found = [inside(h) for h in expand(catalogue()["wear"])]
    assert {h.recording for h in found} == {"two"}
    assert not signatures(trajectory(sample()[0], "one"), found).any()
    assert signatures(trajectory(sample()[0], "two"), found).any()


@pytest.mark.parametrize(
    ("word", "where"), [("sensor_offset_recording", ("T",)), ("input_heat", ("inside",))]
)
def test_a_warm_start_moves_with_an_effect(word: str, where: tuple[str, ...]) -> None:
    """A recording that begins while the machine is warm: a plate begins at its first reading, less what its
    thermometer is off, and what is inside it begins in balance with it and with what heats it.
    """
    time = np.arange(0.0, 4000.0, 50.0)
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "load": Channel("load", "other input", "N", None, "held"),
        "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
        "T": Channel("T", "temperature", "degC", 0.1, "linear"),
    }
    values = {
        "P": np.where(time < 2000, 80.0, 0.0),
        "load": np.where(time < 1000, 300.0, 100.0),
        "T_env": np.full(len(time), 20.0),
        "T": np.full(len(time), 33.0),
    }
    campaign = Campaign("plate", channels, {n: Recording(n, time, values) for n in ("one", "two")})
    terms = (
        Term("drive", "plate", parse("0.5*P")),
        Term("loss", "plate", parse("4*(T_env - plate)")),
        Term("joint", "inside", parse("3*(plate - inside)"), "plate"),
        Term("air inside", "inside", parse("0.5*(T_env - inside)")),
    )
    states = {
        "plate": State("plate", "degC", 3000.0, scale=1 / 3000),
        "inside": State("inside", "degC", 6000.0, scale=1 / 6000),
    }
    plain = Model("plate", {}, states, terms, {"T": parse("plate")})
    after = {"one": ("one", "two"), "two": ("two",)}
    largest = {"P": 80.0, "load": 300.0, "T_env": 20.0}
    seen = Scene(channels, ("T",), ("one", "two"), after, largest, frozenset(["load"]), 0.02, 0.02)
    found = candidates(plain, [catalogue()[word]], seen)
    h = next(h for h in found if h.places == where and h.recording in (None, "two"))
    grid = make_grid(campaign, "two", ["P", "load", "T_env"], ("T",))

    def run(size: float) -> machine.Array:
        model = h.added_to(plain, {h.amplitudes[0]: size})
        return predict(simulate(make_system(model, grid), model.values("two")))

    column = signatures(simulate(make_system(plain, grid), plain.values()), [h])[:, :, 0]
    expected = (run(1e-3) - run(-1e-3)) / 2e-3
    assert np.abs(column - expected).max() < 1e-3 * np.abs(expected).max()
