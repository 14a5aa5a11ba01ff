"""The score of a model: what it adds up, and what it says of a machine that lacks the fluid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from discovery.diagnosis import crossvalidation, thresholds
from discovery.diagnosis.centred import centred
from discovery.diagnosis.context import Context
from discovery.diagnosis.crossvalidation import LeftOut, left_out
from discovery.diagnosis.proof import Improvement
from discovery.diagnosis.refit import refit, score
from discovery.diagnosis.scan import scan_model
from discovery.diagnosis.scored import MOVED, Scored, is_usual, scored, with_change, with_force, with_unknown
from discovery.effects.hypothesis import Hypothesis
from discovery.evaluation.crossvalidation import Fold
from discovery.evidence.process_noise import unknown_heat
from discovery.fitting import Fit, Noise, fit_model
from tests.diagnosis.parts import bare, claim_of, context_of, dry, scored_of, wetted
from tests.machine import NOISE, campaign, changed, model, simulated

Residuals = dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]


def test_the_effect_that_is_there_makes_the_readings_more_likely() -> None:
    assert wetted().evidence > bare().evidence + 50.0
    assert wetted().rms() < bare().rms()
    wrong = scored_of(dry(), claim_of(dry(), "friction_speed", "motor"))
    assert wrong.evidence < wetted().evidence - 50.0


def test_evidence_is_integrated_over_noise_settings() -> None:
    one = wetted()
    (h,) = one.hypotheses
    total = one.levels.max() + np.log(np.sum(np.exp(one.levels - one.levels.max())))
    assert one.evidence == pytest.approx(total + h.log_odds)
    assert one.best == int(np.argmax(one.levels))


def test_heat_that_nobody_records_says_nothing_of_the_flows() -> None:
    """Both much unrecorded heat at a model whose flows are right, and the reverse, are among the settings."""
    floors = {tuple(s.noise.heat.values()) for s in dry().settings if s.noise.heat and s.noise.share == 0.02}
    shares = {s.noise.share for s in dry().settings if s.level == 1.0}
    assert len(floors) == len(thresholds.LEVELS)
    assert shares == set(thresholds.SHARES)
    level = {s.level: next(iter(s.noise.heat.values())) for s in dry().settings if s.noise.heat}
    assert level[5.0] == pytest.approx(5.0 * level[1.0])
    usual = [s for s in dry().settings if is_usual(s)]
    assert {(s.level <= 2.0, s.noise.share <= 0.08, s.noise.form <= 0.08) for s in usual} == {
        (True, True, True)
    }
    count, every = len(bare().settings), list(dry().settings)
    wrong = [s for s in every if s.noise.share > 0.08 or s.noise.form > 0.08]
    heated = [s for s in every if s.level > 2.0 and s not in wrong]
    assert replace(bare(), settings=tuple(wrong[:count])).coarse
    assert not replace(bare(), settings=tuple(heated[:count])).coarse
    assert bare().coarse  # it lacks the fluid
    assert not wetted().coarse


def test_what_does_not_act_is_scored_once() -> None:
    """Its evidence is none under every noise."""
    one = scored(dry(), wetted().hypotheses, wetted().fit)
    index = [u.name for u in one.fit.problem.unknowns].index(one.hypotheses[0].amplitudes[0])
    low, _ = one.fit.problem.bounds
    theta = one.fit.theta.copy()
    theta[index] = low[index]
    none = scored(dry(), one.hypotheses, replace(one.fit, theta=theta))
    assert one.acts
    assert len(one.settings) > 1
    assert not none.acts
    assert len(none.settings) == 1
    assert none.evidence == -np.inf


def test_an_interval_is_of_95_percent() -> None:
    one = centred(dry(), wetted())
    (name,) = one.hypotheses[0].amplitudes
    interval = one.interval(name)
    assert interval is not None
    (index,) = (i for i, u in enumerate(one.fit.problem.unknowns) if u.name == name)
    gram = one.grams[one.best].without(one.seen.spread[sum(one.seen.form) :])
    _, step, covariance = gram.solved()
    k = int(np.flatnonzero(one.seen.moving == index)[0])
    low, high = norm.interval(0.95, one.fit.theta[index] + step[k], np.sqrt(covariance[k, k]))
    assert interval == pytest.approx((low, high), rel=1e-4)
    assert interval[0] < 30.0 < interval[1]  # W/K, as it is


def test_what_presses_against_zero_does_not_act() -> None:
    nothing = replace(wetted(), sizes=np.array([-1], dtype=np.intp))
    assert nothing.level(0) == -np.inf


def test_a_latent_force_explains_what_is_missing_and_nothing_else() -> None:
    lacking = with_force(dry(), bare(), "table")
    assert lacking.evidence > bare().evidence + 10.0
    assert with_force(dry(), wetted(), "table").evidence < wetted().evidence
    odds = np.log(thresholds.ODDS / (len(dry().floor) + len(dry().outputs)))
    assert lacking.prior - bare().prior == pytest.approx(odds)
    assert lacking.forced_state == "table"


def test_what_cannot_matter_is_integrated_only_near_its_best_noise() -> None:
    """What reaches a goal is as exact as without one, and what does not is known to be below."""
    whole = with_unknown(dry(), [bare()], -np.inf)
    goal = max(one.evidence for one in whole) - thresholds.SHORT
    rough = with_unknown(dry(), [bare()], goal)
    places = [*dry().floor, *dry().outputs]
    assert [one.forced.split()[-1] for one in whole[: len(dry().floor)]] == places[: len(dry().floor)]
    assert len(whole) == len(rough) == len(places)
    for one, other in zip(whole, rough, strict=True):
        assert one.forced == other.forced
        if one.evidence >= goal:
            assert other.evidence == one.evidence
        else:
            assert other.evidence <= one.evidence
    assert sum(one.evidence == other.evidence for one, other in zip(whole, rough, strict=True)) < len(places)
    assert whole[places.index("table")].evidence == with_force(dry(), bare(), "table").evidence


def test_a_shape_at_the_end_of_its_range_is_another_law() -> None:
    assert replace(wetted(), outside=True).evidence == -np.inf


def test_a_model_that_is_not_finite_under_a_noise_does_not_count_there() -> None:
    """A winding whose resistance grows with its temperature, on a public recording of an oven."""
    first, *others = wetted().grams
    lost = replace(first, rows=replace(first.rows, logdet=np.full_like(first.rows.logdet, np.nan)))
    levels = replace(wetted(), grams=(lost, *others)).levels
    assert levels[0] == -np.inf
    assert list(levels[1:]) == list(wetted().levels[1:])


def test_a_time_constant_is_known_within_a_factor() -> None:
    """Ends of an interval that is wider than its value are both positive, and far from the limits."""
    one = wetted()
    name = wetted().hypotheses[0].amplitudes[0]
    unknowns = [replace(u, is_log=u.name == name) for u in one.fit.problem.unknowns]
    fit = replace(one.fit, problem=replace(one.fit.problem, unknowns=tuple(unknowns)))
    low, high = one.interval(name) or (0.0, 0.0)
    first, last = replace(one, fit=fit).interval(name) or (0.0, 0.0)
    at = float(one.fit.theta[[u.name for u in unknowns].index(name)])
    assert np.log(last / first) == pytest.approx((high - low) / at)
    assert np.log(first * last / at**2) == pytest.approx((high + low - 2 * at) / at)
    lost = replace(fit, theta=np.where(fit.theta == at, 1e-6 * at, fit.theta))  # any size is as likely
    with np.errstate(over="raise"):
        first, last = replace(one, fit=lost).interval(name) or (0.0, 0.0)
    unknown = next(u for u in unknowns if u.name == name)
    assert first == pytest.approx(unknown.low, abs=1e-9)
    assert last == unknown.high


def test_an_output_may_change_for_a_cause_that_no_body_shows() -> None:
    """A joint that snaps twice a day is no heat: a slow change of this output explains it better than heat at
    any body, and than a slow change of another output.
    """
    runs = [simulated(1), simulated(2)]
    snaps = [changed(r, E_Z=r.values["E_Z"] + 5.0 * NOISE * (np.sin(r.time / 6000.0) > 0.3)) for r in runs]
    context = context_of(campaign(*snaps), model())
    one = score(context, (), context.usual)
    assert one is not None
    at = {output: with_change(context, one, output).evidence for output in context.outputs}
    assert max(at, key=lambda output: at[output]) == "E_Z"
    assert at["E_Z"] > one.evidence + thresholds.SHORT
    assert at["E_Z"] > max(with_force(context, one, state).evidence for state in context.floor)


def test_heat_of_unknown_cause_may_have_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Evidence is the mean over all pairs of a size and a share, of which each is tried near the best one."""
    found = with_force(dry(), bare(), "table")
    pairs = [(size, share) for size in thresholds.UNKNOWN_HEAT for share in thresholds.UNKNOWN_SHARES]
    alone = []
    for size, share in pairs:
        monkeypatch.setattr(thresholds, "UNKNOWN_HEAT", (size,))
        monkeypatch.setattr(thresholds, "UNKNOWN_SHARES", (share,))
        alone.append(with_force(dry(), bare(), "table").evidence)
    mean = np.max(alone) + np.log(np.mean(np.exp(np.array(alone) - np.max(alone))))
    assert found.evidence == pytest.approx(mean, abs=0.7)  # it keeps the likely settings, not all
    assert np.ptp(alone) > 10.0  # a wrong size explains nothing


def test_less_noise_than_usual_is_no_unknown_cause() -> None:
    """Heat of unknown cause adds to the variance that is always there, whatever its size and share."""
    *_, usual = dry().settings
    before = ((usual.noise.heat or {})["table"], usual.noise.share)
    for heat in unknown_heat("table", 1.0, (0.0, 30.0), (0.0, 0.8)):
        after = (heat.on_top_of(usual).noise.force or {})["table"]
        added = np.square(after) - np.square(before)
        assert added == pytest.approx(np.square([heat.heat, heat.share]), abs=1e-9)


def test_a_scan_sees_the_effect_and_what_would_stand_without_it() -> None:
    first = scan_model(dry(), bare())
    assert first.claims[0].hypothesis.key == wetted().hypotheses[0].key
    found = scan_model(dry(), wetted())
    (key,) = wetted().keys
    assert key not in {c.hypothesis.key for c in found.claims}
    assert max(c.odds for c in found.claims) < 0.0
    assert max(c.odds for c in found.without[key]) > 0.0


def test_what_is_there_predicts_recordings_that_are_left_out() -> None:
    (h,) = wetted().hypotheses
    event = claim_of(dry(), "unmeasured_heat", "bed", "r2")
    proofs = left_out(dry(), wetted(), [h, event])
    found = proofs[h.key]
    assert found is not None
    assert found.free.after < 1.2 < found.free.before
    assert found.free.low > 0
    assert found.better == found.blocks > 10
    assert proofs[event.key] is None  # other recordings say nothing of it
    alone = replace(dry(), recordings=("r1",))
    assert left_out(alone, wetted(), [h]) == {h.key: None}


def test_models_are_fitted_to_the_rest_under_the_process_noise_of_the_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else hours of unrecorded heat in a single recording determine its parameters: the slip of a
    joint, which is there, turned free runs of 2.0 reading noises into 6.0, and into 1.4 since then.
    """
    seen = []

    def spied(*args: Any, noise: Noise, **more: Any) -> Fit:
        seen.append(noise)
        return fit_model(*args, noise=noise, **more)

    monkeypatch.setattr(crossvalidation, "fit_model", spied)
    (h,) = wetted().hypotheses
    left_out(dry(), wetted(), [h])
    assert seen == [wetted().noise] * 4
    assert wetted().noise.heat


@pytest.mark.parametrize(("size", "sure"), [(1.2, True), (1.0, False)])
def test_whether_it_is_by_chance_is_judged_under_the_process_noise(
    size: float, sure: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Free runs of a network with a second mass missed by 15.7 and 11.6 reading noises, both for hours."""

    def residuals(_: Context, answer: Scored, chosen: Sequence[Hypothesis], fold: Fold) -> Residuals:
        rng, acts = np.random.default_rng(5), len(chosen) == len(answer.hypotheses)
        hours = np.repeat(rng.uniform(0.0, 20.0, (2, 8, 3)), 50, axis=1)  # without and with it
        z = (1.0 if acts else size) * rng.standard_normal((400, 3))
        return {name: ((0.9 if acts else 1.0) * hours[int(acts)], z) for name in fold.recordings}

    monkeypatch.setattr(crossvalidation, "_residuals", residuals)
    (h,) = wetted().hypotheses
    found = left_out(dry(), wetted(), [h])[h.key]
    assert found is not None
    assert found.free.explained > 1.0
    assert found.free.low < 0  # of the free runs alone
    assert found.sure == sure


def test_an_hour_that_goes_wrong_does_not_outvote_all_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """A printer whose base cools by free convection: free runs of 2.0 reading noises became 1.3, all blocks
    but three were better predicted, and one so much worse that the mean told nothing.
    """
    gains = [10.2, 20.9, 21.8, 21.3, 0.5, 0.3, 1.3, -0.5, -0.1, -92.8, 5.6, 38.7, 41.9, 15.3, 2.5, 3.3]

    def residuals(_: Context, answer: Scored, chosen: Sequence[Hypothesis], __: Fold) -> Residuals:
        acts = len(chosen) == len(answer.hypotheses)
        z = np.sqrt(100.0 - acts * np.array(gains))
        free = np.full((8, 1), 1.3 if acts else 2.0)
        return {"r1": (free, z[:8, None]), "r2": (free, z[8:, None])}

    monkeypatch.setattr(crossvalidation, "_residuals", residuals)
    (h,) = wetted().hypotheses
    found = left_out(replace(dry(), outputs=("E_Y",)), wetted(), [h])[h.key]
    assert found is not None
    assert (found.better, found.blocks) == (13, 16)
    assert found.sure


def test_a_recording_that_others_leave_open_does_not_outvote_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A delay of 160 s: two recordings by a quarter better, and a third, whose loss the two others do not
    determine, missed by 12.7 reading noises, not by 10.8.
    """
    rms = {"r1": (5.7, 4.3), "r2": (4.2, 3.0), "r3": (10.8, 12.7)}

    def residuals(_: Context, answer: Scored, chosen: Sequence[Hypothesis], fold: Fold) -> Residuals:
        acts = len(chosen) == len(answer.hypotheses)
        z = np.random.default_rng(1).standard_normal((400, 1)) / (1.0 if acts else 0.5)
        return {name: (np.full((400, 1), rms[name][acts]), z) for name in fold.recordings}

    monkeypatch.setattr(crossvalidation, "_residuals", residuals)
    context = replace(dry(), outputs=("E_Y",), recordings=("r1", "r2", "r3"))
    (h,) = wetted().hypotheses
    found = left_out(context, wetted(), [h])[h.key]
    assert found is not None
    before, after = ((a * b * c) ** (1 / 3) for a, b, c in zip(*rms.values(), strict=True))
    assert found.free.judged == pytest.approx((before, after))
    assert found.improves


def test_chance_makes_blocks_better_by_as_much_as_signs_that_are_drawn() -> None:
    """Every choice of signs is as likely by chance: of 2^10, those with ranks as high are counted."""
    rng, free = np.random.default_rng(2), Improvement(1.0, 0.9, 0.5, 0.0, 0.0, {})
    signs, ranks = np.array(list(product([-1.0, 1.0], repeat=10))), np.arange(1.0, 11.0)
    seen = set()
    for shift in np.repeat([0.0, 0.5, 0.8, 1.2], 10):
        gains = rng.standard_normal(10) + shift
        own = np.sign(gains) @ np.argsort(np.argsort(np.abs(gains))) + np.sign(gains).sum()
        by_chance = np.mean(signs @ ranks >= own - 1e-9)
        assert LeftOut(free, gains).sure == (by_chance <= 0.02)
        seen.add(LeftOut(free, gains).sure)
    assert seen == {True, False}
    assert not LeftOut(free, np.zeros(4)).sure


def test_hours_in_which_nothing_happens_do_not_outvote_those_in_which_heat_acts() -> None:
    """Heat of a room that was left out: 21 of 36 blocks were better, some by a hundred times what others were
    worse, and its name was withdrawn.
    """
    first = [
        -4.9,
        11.0,
        6.3,
        148.6,
        46.9,
        74.6,
        -0.1,
        11.6,
        -13.3,
        0.7,
        -2.8,
        -8.9,
        5.6,
        -6.8,
        888.2,
        457.1,
        204.9,
        -4.1,
    ]
    second = [
        -5.1,
        -12.4,
        -0.3,
        1.7,
        10.6,
        29.7,
        22.0,
        -3.3,
        17.5,
        6.5,
        3.2,
        834.9,
        75.8,
        -18.0,
        10.2,
        -19.2,
        -0.4,
        -8.6,
    ]
    gains = np.array([*first, *second])
    assert (gains > 0).sum() == 21
    assert LeftOut(Improvement(38.0, 9.3, 0.5, -1.0, 1.0, {}), gains).sure


@pytest.mark.parametrize(("lasts", "sure"), [(10, True), (100, False)])
def test_a_slow_law_shows_in_free_runs_that_miss_many_times(
    lasts: int, sure: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Heat from one room to the next: under the process noise, no reading says more beyond those before it,
    and free runs miss by a third. That is no chance if what they miss by is another thing many times.
    """

    def residuals(_: Context, answer: Scored, chosen: Sequence[Hypothesis], fold: Fold) -> Residuals:
        rng, acts = np.random.default_rng(5), len(chosen) == len(answer.hypotheses)
        hours = np.repeat(rng.normal(0.0, 30.0, (200 // lasts, 1)), lasts, axis=0)
        return {name: (hours / 3 if acts else hours, np.ones((200, 1))) for name in fold.recordings}

    monkeypatch.setattr(crossvalidation, "_residuals", residuals)
    (h,) = wetted().hypotheses
    found = left_out(replace(dry(), outputs=("E_Y",)), wetted(), [h])[h.key]
    assert found is not None
    assert found.blocks == 0
    assert found.sure == sure


def test_a_fit_settles_under_the_noise_that_it_makes_likely() -> None:
    """A single refit under the noise of the model that lacks the fluid does not reach the optimum."""
    coarse = max(dry().settings, key=lambda s: (s.noise.share, s.level)).noise
    chosen = (claim_of(dry(), "fluid_convection", "table"),)
    first = scored(dry(), chosen, refit(dry(), chosen, coarse))
    last = score(dry(), chosen, coarse)
    assert last is not None
    assert first.ahead > MOVED
    assert last.ahead < 0.01 * MOVED
    assert last.reached > first.reached + 0.5
    size = {name: p.value for name, p in last.fit.model.parameters.items()}
    assert size["hF_table"] == pytest.approx(30.0, rel=0.05)
