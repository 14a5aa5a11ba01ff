"""The figures of a proof, by closed forms: models that say a constant, bodies that only add up their heat."""

from __future__ import annotations

from dataclasses import replace
from math import exp, inf, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom, ttest_1samp, wilcoxon

from discovery.diagnosis import thresholds
from discovery.diagnosis.left_open import Known
from discovery.diagnosis.proof import (
    BLOCKS,
    MULTIPLES,
    FreeRuns,
    Improvement,
    explained,
    free_runs,
    improvement,
    size_of,
    surely_better,
    unit_of,
)
from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.evidence.process_noise import noise_in_free_runs
from discovery.fitting import Fit, Noise, fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests import machine

Array = NDArray[np.float64]
TIME = np.arange(0.0, 240 * 600.0, 600.0)
CHANNELS = {name: Channel(name, "error", "um", sd, "linear") for name, sd in (("E", 1.0), ("F", 3.0))}
WHITE = Noise(("E", "F"), (1.0, 3.0))


def said(readings: dict[str, Array], channels: dict[str, Channel] | None = None) -> Campaign:
    return Campaign("c", channels or CHANNELS, {"r": Recording("r", TIME, readings)})


def constant(seen: Campaign, **formulas: str) -> Fit:
    """A model that says the same all the time, as a fit that has nothing to fit."""
    states = {"x": State("x", "degC", 1000.0, parse("0"), 0.0, 1e-3)}
    model = Model("m", {}, states, (), {n: parse(f) for n, f in formulas.items()})
    return fit_model(model, seen, ["r"], list(formulas))


def body(heat: float = 0.0) -> Trajectory:
    """A free run of a body of 1000 J/K without any loss, through which some W flow."""
    states = {"x": State("x", "degC", 1000.0, parse("0"), 0.0, 1e-3)}
    terms = (Term("in", "x", parse(f"{heat}")), Term("out", "x", parse(f"-{heat}"))) if heat else ()
    model = Model("m", {}, states, terms, {"E": parse("x")})
    return simulate(make_system(model, make_grid(said({"E": np.zeros(240)}), "r", [], ["E"])), {})


def test_outputs_of_one_unit_weigh_alike() -> None:
    """The plain rms of all readings. Two noises off before the repair and one after it: each draw is about
    the same. A thermometer whose noise is next to none does not decide alone.
    """
    seen = said({"E": np.full(240, 3.0), "F": np.where(np.arange(240) % 3 == 0, 9.0, np.nan)})
    unit = sqrt((3 * 1.0**2 + 3.0**2) / 4)  # a third of the readings of F
    runs = free_runs(seen, ["r"], constant(seen, E="x+1", F="x+3"), constant(seen, E="x+2", F="x+6"), WHITE)
    found = improvement([runs["r"]], ["E", "F"])
    assert size_of(seen, WHITE) == pytest.approx([1.0, 1.0])
    assert (found.before, found.after, found.floor) == pytest.approx((2 * unit, unit, unit))
    assert (found.low, found.high) == pytest.approx((unit, unit), rel=0.01)
    assert found.outputs["E"] == pytest.approx((2.0, 1.0))
    assert found.outputs["F"] == pytest.approx((6.0, 3.0))


@pytest.mark.parametrize(("unit", "word"), [("um", "um"), ("degC", MULTIPLES)])
def test_outputs_of_several_units_are_told_in_multiples_of_their_noise(unit: str, word: str) -> None:
    """A mean of um and K is neither."""
    channels = {**CHANNELS, "F": replace(CHANNELS["F"], unit=unit)}
    seen = said({"E": np.zeros(240), "F": np.zeros(240)}, channels)
    assert unit_of(seen, ["E", "F"]) == word
    assert size_of(seen, WHITE) == pytest.approx([1.0, 1.0] if unit == "um" else [1.0, 3.0])


def test_what_parameters_leave_open_is_expected_of_an_unseen_recording() -> None:
    """E = a t/day with a standard error of 0.3 in a: the rms of t/day over the readings times 0.3."""
    seen = said({"E": np.zeros(240)})
    states = {"x": State("x", "degC", 1000.0, parse("0"), 0.0, 1e-3)}
    outputs = {"E": parse("a*time/86400")}
    model = Model("m", {"a": Parameter(0.0, "um", fixed=True)}, states, (), outputs)
    fit = fit_model(model, seen, ["r"], ["E"])
    noise = Noise(("E",), (2.0,))
    known = Known(("a",), np.array([[0.09]]))
    found = improvement([free_runs(seen, ["r"], fit, fit, noise, known)["r"]], ["E"])
    expected = 0.3 * sqrt(np.mean((TIME / 86400.0) ** 2))
    assert found.unsure == pytest.approx(expected, rel=1e-6)
    assert found.floor == pytest.approx(2.0)
    assert found.expected == pytest.approx(sqrt(expected**2 + 4.0), rel=1e-6)
    assert improvement([free_runs(seen, ["r"], fit, fit, noise)["r"]], ["E"]).unsure == 0.0


def two_bodies(seen: Campaign, formula: str, spread: float) -> Fit:
    """Two bodies that cool down, within 2 h and within 6 h, from starts that are known within a spread."""
    states = {n: State(n, "K", None, parse("0"), spread, 1.0) for n in ("x", "z")}
    terms = (Term("x", "x", parse("-x/7200")), Term("z", "z", parse("-z/21600")))
    return fit_model(Model("m", {}, states, terms, {"E": parse(formula)}), seen, ["r"], ["E"])


def test_where_a_hidden_body_begins_is_no_merit_of_a_model() -> None:
    """E = x + z. A warm x and a cold z cancel in the first reading, which says nothing of them: free runs
    miss 200 (exp(-t/2 h) - exp(-t/6 h)). From known starts they miss nothing but a step of 30 um, and what
    of it the two may imitate, by least squares.
    """
    fast, slow = np.exp(-TIME / 7200.0), np.exp(-TIME / 21600.0)
    step = np.where(TIME > 72000.0, 30.0, 0.0)
    seen = said({"E": 200.0 * (fast - slow) + step})
    before = two_bodies(seen, "x + z", spread=200.0)
    after = two_bodies(seen, "x + z + where(time > 72000, 30, 0)", spread=200.0)
    found = improvement(list(free_runs(seen, ["r"], before, after, Noise(("E",), (1.0,))).values()), ["E"])
    assert found.after == pytest.approx(200.0 * np.sqrt(np.mean((fast - slow) ** 2)), rel=1e-3)
    left = np.linalg.lstsq(np.column_stack((fast, slow)), step)[1]
    assert found.judged == pytest.approx((np.sqrt(left[0] / len(TIME)), 0.0), rel=0.02, abs=0.1)
    assert found.explained == pytest.approx(found.judged[0], rel=1e-3)


def test_both_models_begin_within_the_same_spread() -> None:
    """A saw that was warm where an unseen recording began. The better model, which knows the step of 30 um,
    finds starts closer to where they are said to be: within twice 20 K of its own, x and z would begin 160 K
    off.
    """
    fast, slow = np.exp(-TIME / 7200.0), np.exp(-TIME / 21600.0)
    step = np.where(TIME > 72000.0, 30.0, 0.0)
    seen = said({"E": 200.0 * (fast - slow) + step})
    before = two_bodies(seen, "x + z", spread=200.0)
    after = two_bodies(seen, "x + z + where(time > 72000, 30, 0)", spread=20.0)
    for pair in ((before, after), (after, before)):
        runs = free_runs(seen, ["r"], *pair, Noise(("E",), (1.0,)))
        judged = improvement(list(runs.values()), ["E"]).judged
        assert judged[pair.index(after)] == pytest.approx(0.0, abs=0.1)
        assert judged[pair.index(before)] > 5.0


def test_a_single_wrong_reading_is_set_aside_in_a_proof() -> None:
    """One reading of 400 um among 240: with it the rms would be 26."""
    wrong = np.random.default_rng(1).normal(0.0, 1.0, 240)
    wrong[100] += 400.0
    seen = said({"E": wrong})
    fit = constant(seen, E="x")
    (run,) = free_runs(seen, ["r"], fit, fit, Noise(("E",), (1.0,))).values()
    found = improvement([run], ["E"])
    assert found.before == pytest.approx(np.std(np.delete(wrong, 100)), rel=0.02)


def test_the_bounds_are_those_of_a_draw_of_blocks() -> None:
    """Better in half of the blocks, worse in the others: how many of each are drawn is binomial."""
    one = np.repeat([1.0, -1.0], 120)[:, None]
    found = improvement([FreeRuns(one, one - 0.5, 1.0, np.ones(1))], ["E"])
    better = binom.ppf([0.025, 0.975], BLOCKS, 0.5) / BLOCKS
    low, high = 1 - np.sqrt(0.25 * better + 2.25 * (1 - better))
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.08)
    assert not found.contradicts


def test_what_is_worse_everywhere_contradicts_a_repair() -> None:
    rng = np.random.default_rng(2)
    one = rng.normal(0.0, 1.0, (240, 2))
    assert improvement([FreeRuns(one, 2 * one, 1.0, np.ones(2))], ["E", "F"]).contradicts
    lost = improvement([FreeRuns(one, None, 1.0, np.ones(2))], ["E", "F"])
    assert lost.contradicts
    assert lost.after == inf


def test_worse_from_the_first_readings_contradicts_a_repair() -> None:
    """A slow path whose own start all readings show, and the first ones do not."""
    from_all = (1.8, 2.0, -0.6, 0.2)
    assert Improvement(1.8, 3.4, 1.1, -2.2, -0.9, {}, started=from_all).contradicts
    assert not Improvement(1.8, 1.9, 1.1, -0.5, 0.3, {}, started=from_all).contradicts


def test_slow_noise_adds_to_the_floor() -> None:
    assert noise_in_free_runs(body(), Noise(("E",), (3.0,), (4.0,)), np.array([3.0])) == pytest.approx(
        5.0 / 3.0
    )


@pytest.mark.parametrize(("floor", "share", "flow"), [(0.05, 0.0, 0.0), (0.03, 0.4, 0.1)])
def test_process_noise_adds_to_the_floor_what_a_body_makes_of_it(
    floor: float, share: float, flow: float
) -> None:
    """The variance of the integral of first-order noise of 0.05 W, of which a share may follow the flows."""
    tau = 3 * 3600.0
    noise = Noise(("E",), (1.0,), (), {"x": floor, "gone": 9.0}, share, heat_time=tau)
    found = noise_in_free_runs(body(flow / sqrt(2)), noise, np.ones(1))  # what comes in and what goes out
    walk = [2 * (0.05 / 1000.0) ** 2 * tau * (t - tau * (1 - exp(-t / tau))) for t in TIME]
    assert np.mean(walk) > 1.0
    assert found == pytest.approx(sqrt(1.0 + np.mean(walk)), rel=0.02)


def improved(before: float, after: float, floor: float = 1.0) -> Improvement:
    return Improvement(before, after, floor, 0.0, 0.0, {})


def test_what_is_explained_is_a_share_of_what_can_be() -> None:
    two = improved(3.0, 2.0)  # 5 of 8
    assert explained({"a": two}) == pytest.approx(5 / 8)
    assert explained({"a": two, "b": improved(5.0, 5.0)}) == pytest.approx(5 / 32)
    assert explained({"a": improved(3.0, 0.5)}) == 1.0  # nothing goes below the noise
    assert explained({"a": improved(3.0, inf)}) == -1.0


def test_where_only_noise_is_nothing_can_be_explained() -> None:
    noisy = improved(1.02, 0.5)
    assert explained({}) is None
    assert explained({"a": noisy}) is None
    assert explained({"a": noisy, "b": improved(3.0, 2.0)}) == pytest.approx(5 / 8)


def test_a_model_that_runs_away_on_other_inputs_is_told() -> None:
    """Heat that grows with what it heats: stable while the table turns slowly, not at the speed of r2."""
    terms = (*machine.model().terms, Term("feedback", "table", parse("k*speed*(table - T_env)")))
    k = Parameter(0.001, "1", fixed=True)
    plain = machine.model()
    hot = replace(plain, terms=terms, parameters={**plain.parameters, "k": k})
    slow = machine.simulated(1)
    slow = machine.changed(slow, speed=np.full(len(slow.time), 300.0))
    fast = replace(machine.changed(slow, speed=np.full(len(slow.time), 3e6)), name="r2")
    runs = machine.campaign(slow, fast)
    before, after = (fit_model(one, runs, ["r1"], list(machine.SEEN)) for one in (plain, hot))
    noise = Noise(tuple(machine.SEEN), (machine.NOISE,) * 3)
    found = free_runs(runs, ["r1", "r2"], before, after, noise)
    assert found["r1"].after is not None
    assert found["r2"].after is None
    assert free_runs(runs, ["r2"], after, before, noise) == {}  # a baseline that runs away proves nothing


@pytest.mark.parametrize(("before", "after", "found"), [(5.0, 4.0, 3.0), (4.0, 5.0, -3.0), (1.0, inf, -inf)])
def test_what_a_repair_explains_is_what_squares_leave(before: float, after: float, found: float) -> None:
    assert improved(before, after).explained == pytest.approx(found)


@pytest.mark.parametrize("count", [3, 6, 8, 20, 45])
def test_signed_ranks_are_those_of_scipy(count: int) -> None:
    rng = np.random.default_rng(count)
    decided = set()
    for shift in np.linspace(0.0, 2.0, 25):
        gains = rng.standard_normal(count) + shift
        chance = wilcoxon(gains, alternative="greater", method="exact").pvalue
        assert surely_better(gains) == (chance <= 1.0 - thresholds.SUREST)
        decided.add(surely_better(gains))
    assert decided == ({False} if count < 6 else {False, True})  # of five, all are better with 3 %


@pytest.mark.parametrize(("better", "sure"), [(12, False), (13, True)])
def test_of_gains_that_are_alike_their_number_counts(better: int, sure: bool) -> None:
    """The sign test: 12 or more of 16 are better by chance with 3.8 %, 13 or more with 1.1 %."""
    gains = np.where(np.arange(16) < better, 0.3, -0.3)
    assert surely_better(gains) is sure
    assert surely_better(gains[::-1]) is sure
    assert bool(binom.sf(better - 1, 16, 0.5) <= 1.0 - thresholds.SUREST) is sure


@pytest.mark.parametrize("count", [2, 3, 5])
def test_a_few_blocks_are_enough_where_each_is_far_better(count: int) -> None:
    """Ranks of five blocks never say so (3 %); Student's test as of scipy."""
    rng = np.random.default_rng(count)
    decided = set()
    for shift in np.linspace(0.0, 8.0, 40):
        logs = 0.3 * rng.standard_normal(count) + shift
        gains = np.exp(logs) - 1.0
        chance = ttest_1samp(logs, 0.0, alternative="greater").pvalue
        assert surely_better(gains, logs) == (chance <= 1.0 - thresholds.SUREST)
        assert not surely_better(gains)
        decided.add(surely_better(gains, logs))
    assert decided == {False, True}
    assert not surely_better(np.ones(1), np.array([50.0]))
    assert not surely_better(np.zeros(3), np.zeros(3))


def test_blocks_that_are_no_other_count_neither_way() -> None:
    gains = np.array([3.0, 0.0, 2.0, 0.0, 5.0, 1.0, 4.0, 6.0, 0.0])
    assert surely_better(gains)
    assert not surely_better(np.zeros(9))
    assert not surely_better(np.zeros(0))
