"""Update by evidence: an unchanged machine is left alone, wear is followed, nothing else is signed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.update_exact import read_with
from discovery.cli import app
from discovery.errors import UserError
from discovery.export.document import Exported, read_document, write_document
from discovery.export.knowledge import read_knowledge
from discovery.recordings import Campaign, Recording
from discovery.runtime.advice import measure_more
from discovery.runtime.changes import Change, Table, Wear
from discovery.runtime.hypotheses import Comparison, compare
from discovery.runtime.newphysics import Point, Task
from discovery.runtime.update import Update, next_name, update_file
from discovery.runtime.verdict import (
    NOTHING,
    SOMETHING_ELSE,
    WEAR,
    Explanation,
    explains_all,
    probability,
    verdict_of,
)
from discovery.runtime.wear import ageing
from discovery.virtual.machine import Machine
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import Order, Request, take
from tests.recordings.damages import write_campaign

ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")


def days(
    machine: Campaign, count: int, plant: Machine, effects: tuple[Request, ...] = (), readings: int = 8
) -> Campaign:
    """Days of 24 h with a few readings each."""
    recordings = {}
    for k in range(count):
        columns = take(Order(f"d{k}", "fit", 300 + k, 24.0, machine=plant, effects=effects, age=1.0)).columns
        values = {name: series for name, series in columns.items() if name != "time"}
        read = np.flatnonzero(np.isfinite(values[ERRORS[0]]))
        chosen = read[np.linspace(0, len(read) - 1, readings).astype(int)]
        for name in ERRORS:
            keep = np.isin(np.arange(len(columns["time"])), chosen)
            values[name] = np.where(keep, values[name], np.nan)
        recordings[f"d{k}"] = Recording(f"d{k}", columns["time"], values)
    return replace(machine, recordings=recordings)


def less_loss(factor: float) -> tuple[Request, ...]:
    return tuple(Request("wear", 1.0 - factor, (body,)) for body in ("c_body_1", "c_body_2"))


@pytest.fixture
def at_work(document: bytes, tmp_path: Path) -> Path:
    path = tmp_path / "model.json"
    path.write_bytes(document)
    return path


def test_a_machine_that_has_not_changed_keeps_its_model(machine: Campaign, at_work: Path) -> None:
    campaign = days(machine, 3, five_axis())
    found = update_file(at_work, campaign, list(campaign.recordings), at_work.with_name("new.json"))
    assert found.comparison.verdict == "nothing"
    assert max(v for n, v in found.comparison.odds.items() if n != "nothing") < 3.0
    assert found.path is None
    assert not at_work.with_name("new.json").exists()
    kept, hidden = found.lines()[-2:]
    assert "these recordings show no change" in kept
    assert "smaller changes may be hidden" in hidden
    percent = float(hidden.split("wear with P_drive up to ")[1].split(" %")[0])
    assert 2.0 < percent < 12.0  # less_loss(0.8) and (0.9) are found in as many readings


def test_only_what_wear_can_change_is_told_to_age(exported: Exported) -> None:
    """Conductances and the air around the bodies depend on no load, speed or flow."""
    wanted = {"loss_table", "loss_c1", "loss_c2", "cool_c1", "cool_c2", "hF_table", "hF_c1", "h_still"}
    assert set(ageing(exported)) == wanted


def test_wear_is_followed_and_written_with_its_history(machine: Campaign, at_work: Path) -> None:
    campaign = days(machine, 3, five_axis(), less_loss(0.8), readings=24)
    out = at_work.with_name("new.json")
    found = update_file(at_work, campaign, list(campaign.recordings), out)
    assert found.comparison.verdict == "wear"
    assert found.path == out
    assert f"{out}: the next revision" in found.lines()[-1]
    old, new = read_document(at_work), read_document(out)
    assert new.revision == 2
    assert new.changelog[-1]["of"] == old.seal.sha256
    assert "wear" in new.changelog[-1]["text"]
    total = {
        which: sum(one.model.parameters[name].value for name in ("loss_table", "loss_c1", "loss_c2"))
        for which, one in (("old", old), ("new", new))
    }
    assert total["new"] / total["old"] == pytest.approx(0.8, abs=0.06)
    for name, p in new.model.parameters.items():
        if name in ageing(old):
            assert p.low is not None
            assert p.high is not None
            assert p.min <= p.low <= p.value <= p.high <= p.max
        else:
            assert p.value == old.model.parameters[name].value
    assert old.document["inputs"] == new.document["inputs"]
    assert found.after is not None
    assert found.after < 0.6 * found.comparison.rms


def test_a_revision_is_exported_to_further_targets(machine: Campaign, at_work: Path) -> None:
    campaign = days(machine, 2, five_axis(), less_loss(0.8), readings=24)
    out = at_work.with_name("new.json")
    assert update_file(at_work, campaign, list(campaign.recordings), out).path == out
    done = CliRunner().invoke(app, ["export", str(out), "--to", "st", "--to", "scl"])
    assert done.exit_code == 0, done.output
    assert list((out.with_suffix("") / "st").glob("*.scl"))
    again = read_document(next(out.with_suffix("").glob("*.json")))
    assert again.seal.sha256 == read_document(out).seal.sha256
    refused = CliRunner().invoke(app, ["export", str(out), "--to", "st", "--model", "x"])
    assert refused.exit_code == 2


def warm_room(campaign: Campaign) -> Campaign:
    """The sensor of the room shows 1.5 K too much."""
    recordings = {
        name: replace(r, values={**r.values, "T_env": r.values["T_env"] + 1.5})
        for name, r in campaign.recordings.items()
    }
    return replace(campaign, recordings=recordings)


def test_a_faulty_sensor_is_named_and_nothing_is_signed(machine: Campaign, at_work: Path) -> None:
    campaign = warm_room(days(machine, 3, five_axis()))
    found = update_file(at_work, campaign, list(campaign.recordings), at_work.with_name("new.json"))
    assert (found.comparison.verdict, found.comparison.what) == ("input sensor", "T_env")
    assert found.path is None
    assert "the sensor of T_env has an offset" in found.lines()[-1]


def test_new_physics_is_named_and_nothing_is_signed(machine: Campaign, at_work: Path) -> None:
    """A path of heat that changes its own temperatures by half: to first order three others look better."""
    path = (Request("conduction_path", 60.0, ("b_body_2", "c_body_1")),)
    campaign = days(machine, 3, five_axis(), path, readings=24)
    found = update_file(at_work, campaign, list(campaign.recordings), at_work.with_name("new.json"))
    assert found.comparison.verdict == "new physics"
    assert found.comparison.what == "conduction_path at c_body_1, b_body_2"
    assert found.comparison.probability is not None
    assert 0.7 <= found.comparison.probability <= 0.98
    assert found.path is None
    assert not at_work.with_name("new.json").exists()
    said = found.lines()
    assert "conduction_path at c_body_1, b_body_2: probability 0." in said[-2]
    assert "W/K, 95 %" in said[-2]
    assert "add conduction_path at c_body_1, b_body_2 to it" in said[-1]


def test_what_no_effect_of_the_catalogue_explains_is_something_else(machine: Campaign, at_work: Path) -> None:
    """Hot swarf follows a cutting power that nobody records."""
    campaign = days(machine, 3, five_axis(), (Request("swarf_heat", 200.0, ("table",)),), readings=24)
    found = update_file(at_work, campaign, list(campaign.recordings), at_work.with_name("new.json"))
    assert found.comparison.verdict == "something else"
    assert found.path is None
    assert "no effect of the catalogue explains" in found.lines()[-1]


def test_a_flooded_gap_is_never_taken_for_a_sensor(machine: Campaign, at_work: Path) -> None:
    """Eight readings a day hardly show 60 W/K: they leave it open, and nothing is written."""
    campaign = days(machine, 3, five_axis(), (Request("flooded_gap", 60.0, ("b_body_1", "c_body_1")),))
    found = compare(read_document(at_work), campaign, list(campaign.recordings))
    assert found.verdict in ("nothing", "undecided", "something else")


def test_odds_are_those_of_the_joint_gaussian() -> None:
    """Against the densities of the residual with its full covariances, by scipy."""
    from scipy.stats import multivariate_normal

    rng = np.random.default_rng(3)
    base, slopes, r = rng.normal(size=(40, 6)), rng.normal(size=(40, 5)), rng.normal(size=40)
    seen = Table(r, base, slopes, {}, {}, np.ones(6), 0, 6).seen()
    usual = np.eye(40) + base @ base.T
    density = multivariate_normal(np.zeros(40), usual).logpdf(r)
    for at in ([0], [1, 4], [4, 0, 2]):
        root = rng.normal(size=(len(at), len(at)))
        j = slopes[:, at] @ root
        change = Change(np.array(at), root)
        whole = multivariate_normal(np.zeros(40), usual + j @ j.T).logpdf(r)
        assert seen.log_odds(change) == pytest.approx(whole - density)
        gain = root @ j.T @ np.linalg.inv(usual + j @ j.T)
        size, covariance = seen.size(change)
        assert size == pytest.approx(gain @ r)
        assert covariance == pytest.approx(root @ root.T - gain @ j @ root.T)


def test_where_nothing_can_wear_nothing_has() -> None:
    """A model of errors without a heat or an exchange: its update ended in a traceback."""
    rng = np.random.default_rng(6)
    natural = rng.normal(size=(20, 3))
    table = Table(rng.normal(size=20), natural, np.zeros((20, 2)), {}, {}, np.ones(3), 12, 3)
    found = table.followed(Wear(np.arange(1), np.arange(1, 2), np.zeros((1, 0))))
    assert found.by == pytest.approx(np.zeros(1))


def test_what_is_known_after_wear_is_the_joint_gaussian() -> None:
    """Rows for the next comparison, against dense covariances: parameters p of the fit, p + a at the end."""
    rng = np.random.default_rng(5)
    fitted, new, p, kept = 30, 25, 3, 5  # of five unknowns of the fit three are parameters, and one start
    spread = rng.uniform(0.5, 2.0, kept + 1)
    natural, grown = rng.normal(size=(fitted + new, kept + 1)), rng.normal(size=(new, p))
    natural[:fitted, kept] = 0.0
    slopes = np.zeros((fitted + new, 2 * p))
    slopes[fitted:] = np.hstack([natural[fitted:, :p], grown])
    r, root = rng.normal(size=fitted + new), rng.normal(size=(p, 2))
    table = Table(r, natural * spread, slopes, {}, {}, spread, fitted, kept)
    found = table.followed(Wear(np.arange(p), np.arange(p, 2 * p), root))
    # theta = p + before + during: the fit saw p, the new readings p + before + grown part of during
    before = np.vstack([-natural[:fitted, :p], np.zeros((new, p))]) @ root
    during = np.vstack([-natural[:fitted, :p], grown - natural[fitted:, :p]]) @ root
    start = natural[:, kept:] * spread[kept]
    usual = np.linalg.inv(np.eye(fitted + new) + before @ before.T + during @ during.T + start @ start.T)
    seen = natural[:, :kept]
    information, pull = seen.T @ usual @ seen, seen.T @ usual @ r
    rows = found.rows
    assert rows[:, 1:].T @ rows[:, 1:] == pytest.approx(information, rel=1e-4, abs=1e-6)
    shift = np.concatenate([found.by, np.zeros(kept - p)])
    assert rows[:, 1:].T @ rows[:, 0] == pytest.approx(pull - information @ shift, rel=1e-4, abs=1e-3)
    mean = np.linalg.solve(information + np.diag(spread[:kept] ** -2.0), pull)
    signal, mine = seen[fitted:] @ mean, natural[fitted:, :p] @ root
    assert found.by == pytest.approx(root @ np.linalg.solve(mine.T @ mine + np.eye(2), mine.T @ signal))


def test_what_wears_alike_changes_alike(exported: Exported) -> None:
    loads = ageing(exported)
    assert loads["loss_c1"] == loads["loss_c2"] == {"P_drive"}
    assert loads["cool_c1"] == {"T_cool"}
    assert loads["hF_table"] == loads["h_still"] != loads["loss_c1"]


def test_a_machine_that_has_worn_is_followed_without_new_evidence(machine: Campaign, at_work: Path) -> None:
    """A change of 2 % is no evidence on a new machine, but on one that was seen to wear it is the usual."""
    worn = days(machine, 2, five_axis(), less_loss(0.8), readings=24)
    further = days(machine, 3, five_axis(), less_loss(0.78), readings=24)
    kept = days(machine, 3, five_axis(), less_loss(0.98), readings=8)
    assert compare(read_document(at_work), kept, list(kept.recordings)).verdict == "nothing"
    second = next_name(at_work)
    assert update_file(at_work, worn, list(worn.recordings), second).path == second
    after = read_document(second)
    assert set(after.document["knowledge"]["worn"]) >= {"loss_c1", "loss_c2"}
    found = compare(after, further, list(further.recordings))
    assert found.verdict in ("wear goes on", "wear")
    by, sd = found.change["loss_c1"]
    assert by / after.model.parameters["loss_c1"].value == pytest.approx(0.78 / 0.8 - 1.0, abs=0.02)
    assert 0.0 < sd < 0.05 * after.model.parameters["loss_c1"].value


def test_mistakes_are_sentences(machine: Campaign, at_work: Path, exported: Exported, tmp_path: Path) -> None:
    campaign = days(machine, 1, five_axis())
    values = {n: s for n, s in campaign.recordings["d0"].values.items() if n not in ERRORS}
    blind = replace(campaign, recordings={"d0": replace(campaign.recordings["d0"], values=values)})
    with pytest.raises(UserError, match="holds no reading"):
        update_file(at_work, blind, ["d0"], tmp_path / "new.json")
    former = {"covariance": [[1.0]], "first": [1.0], "slow_share": 0.5}  # what version 0.2 kept
    cases: list[dict[str, object]] = [{"parameters": []}, {"parameters": ["hA_b1"], **former}]
    for own in cases:
        unknown = {"residual": exported.document["knowledge"]["residual"], **own}
        write_document(tmp_path / "unknown.json", {**exported.document, "knowledge": unknown})
        with pytest.raises(UserError, match="how well its parameters are known"):
            update_file(tmp_path / "unknown.json", campaign, ["d0"], tmp_path / "new.json")


def test_the_command(machine: Campaign, at_work: Path) -> None:
    campaign = days(machine, 1, five_axis())
    roles = {name: (channel.role, channel.unit) for name, channel in machine.channels.items()}
    frames = {name: {"time": r.time, **r.values} for name, r in campaign.recordings.items()}
    folder = write_campaign(at_work.with_name("days"), "a day", roles, frames)
    arguments = ["update", str(at_work), str(folder / "campaign.toml"), "--recording", "d0"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "d0: nothing" in done.output
    assert "the model is kept" in done.output


def test_what_readings_do_not_distinguish_is_not_signed() -> None:
    sensor = Explanation("sensor of", "T")
    evidence = {WEAR: 12.0, sensor: 14.5, SOMETHING_ELSE: 4.0}
    odds = {NOTHING: 0.0, WEAR: 12.0, sensor: 11.5, SOMETHING_ELSE: 2.0}
    assert verdict_of(odds, evidence) == ("undecided", "wear or sensor of T")
    assert verdict_of({**odds, sensor: 1.0}, evidence) == ("wear", "")
    assert verdict_of({**odds, WEAR: 2.0, sensor: 1.0}, evidence) == ("nothing", "")
    assert verdict_of({**odds, WEAR: 5.0}, evidence) == ("input sensor", "T")
    assert verdict_of({**odds, SOMETHING_ELSE: 20.0}, evidence) == ("something else", "")
    weak = verdict_of({**odds, WEAR: -1.0, sensor: 6.0}, {**evidence, sensor: 9.0})
    assert weak == ("undecided", "sensor of T or something else")
    rare = {SOMETHING_ELSE: -4.0, WEAR: -1.0, sensor: 6.0}  # what is named is what is likely
    assert verdict_of({**odds, **rare}, {**evidence, sensor: 9.0}) == (
        "undecided",
        "sensor of T or no change",
    )
    fan, drift = Explanation("exchange with", "T"), Explanation("effect", "drift at S", "drift")
    likely = {**odds, WEAR: 0.0, fan: 12.0}
    assert verdict_of(likely, {**evidence, fan: 16.0}) == ("undecided", "exchange with T or sensor of T")
    assert verdict_of({**likely, fan: 9.0}, {**evidence, fan: 13.0}) == ("input sensor", "T")
    most = verdict_of({**likely, drift: 12.5}, {**evidence, fan: 16.0})
    assert most == ("undecided", "drift at S or exchange with T")
    acts, idle = Explanation("input", "fan"), Explanation("no input", "fan")
    for one, verdict in ((acts, "unused input"), (idle, "idle input")):
        assert verdict_of({**odds, one: 30.0}, {**evidence, one: 32.0}) == (verdict, "fan")
    said = Comparison(("a",), 9, "undecided", "wear or sensor of T", {}, 1.4, 1.4, {}, np.zeros((0, 1)))
    assert Update(said, advice=measure_more(["P"])).lines()[-1].endswith(measure_more(["P"]))
    quiet = replace(said, verdict="nothing", what="", unseen={"sensor of T": "0.5 K"})
    assert Update(quiet).lines()[-1].endswith("sensor of T up to 0.5 K")


def test_an_effect_is_named_only_where_it_is_sure() -> None:
    """Its evidence and its probability are those that a name needs in a diagnosis."""
    gap, again = (Explanation("effect", what, "flooded_gap") for what in ("gap", "gap 2"))
    path, fan = Explanation("effect", "path", "conduction_path"), Explanation("exchange with", "T")
    evidence = {WEAR: 4.0, SOMETHING_ELSE: 4.0}
    odds = {NOTHING: 0.0, WEAR: 4.0, SOMETHING_ELSE: 3.9, gap: 20.0, path: 18.5, again: 19.9}
    assert verdict_of(odds, evidence) == ("new physics", "gap")
    assert probability(odds, gap) == pytest.approx(1 / (1 + np.exp(-1.5)))
    assert probability({**odds, path: -50.0}, gap) == 0.98
    assert verdict_of({**odds, path: 19.5}, evidence) == ("undecided", "gap or path")
    assert verdict_of({**odds, gap: 12.0, path: 1.0, again: 1.0}, evidence)[0] == "undecided"
    assert verdict_of({**odds, WEAR: 10.0}, evidence) == ("wear", "")  # an effect adds too little
    assert verdict_of({**odds, fan: 19.5}, {**evidence, fan: 23.0}) == ("undecided", "gap or exchange with T")
    assert verdict_of({**odds, fan: 30.0}, {**evidence, fan: 34.0}) == ("new physics", "exchange with T")
    large = {NOTHING: 0.0, WEAR: 7626.0, SOMETHING_ELSE: 9864.0, fan: 10001.0}  # cooling by a fifth less
    assert verdict_of(large, {**evidence, fan: 10001.0}) == ("new physics", "exchange with T")
    close = {**odds, gap: 12.0, path: 1.0, again: 1.0}  # what leads is among what is undecided
    assert verdict_of(close, evidence) == ("undecided", "gap or wear")
    small = {NOTHING: 0.0, WEAR: -1.0, SOMETHING_ELSE: -2.0, gap: 10.0}
    assert verdict_of(small, evidence) == ("nothing", "")


def test_a_sensor_explains_all_or_is_not_named() -> None:
    """Heat that an offset of a sensor explains in part leaves something else to explain."""
    assert explains_all("input sensor", "T_env", -4.0) == ("input sensor", "T_env")
    assert explains_all("input sensor", "T_env", -0.3) == (
        "undecided",
        "sensor of T_env alone or with something else",
    )
    assert explains_all("wear", "", 2.0) == ("wear", "")
    assert explains_all("wear", "", 3.0)[0] == "something else"


def test_a_path_of_heat_is_not_taken_for_a_sensor(machine: Campaign, at_work: Path) -> None:
    """With few readings, a path to a body that nothing heats looks like a wrong room."""
    path = (Request("conduction_path", 60.0, ("b_body_2", "table")),)
    campaign = days(machine, 3, five_axis(), path)
    found = compare(read_document(at_work), campaign, list(campaign.recordings))
    assert found.verdict in ("undecided", "something else", "new physics"), found
    assert "T_env" not in found.what or found.verdict == "undecided"


def test_a_fan_is_another_exchange_with_the_room(
    machine: Campaign, at_work: Path, exported: Exported
) -> None:
    """All bodies of a machine whose laws are the model's lose 60 % more heat to the air."""
    model = exported.model
    fan = model.with_values({n: 1.6 * p.value for n, p in model.parameters.items() if n.startswith("hA_")})
    campaign = read_with(fan, days(machine, 3, five_axis(), readings=24), 5)
    found = update_file(at_work, campaign, list(campaign.recordings), at_work.with_name("new.json"))
    assert (found.comparison.verdict, found.comparison.what) == ("new physics", "exchange with T_env")
    assert found.comparison.share is not None
    assert found.comparison.share == pytest.approx(0.6, abs=0.15)  # to first order
    assert "all of it changed by about +" in found.lines()[-2]
    assert found.path is None


def test_the_evidence_of_an_effect_is_an_integral_over_its_size(
    machine: Campaign, exported: Exported
) -> None:
    """Against a sum over sizes of the likelihood of the model with the effect, times the prior."""
    path = (Request("conduction_path", 60.0, ("b_body_2", "c_body_1")),)
    campaign = days(machine, 2, five_axis(), path)
    known = read_knowledge("model", exported.document["knowledge"])
    task = Task.of(exported.model, known, campaign, list(campaign.recordings), ERRORS)
    claim = next(
        one
        for one in task.scan()
        if one.hypothesis.effect.word == "conduction_path"
        and set(one.hypothesis.states) == {"c_body_1", "b_body_2"}
    )
    found = task.fitted(claim)
    assert found is not None
    assert found.size[0] > 1.5 * claim.size[0]  # to first order it does not change its own temperatures
    slab, step = task.sizes.slab([claim.hypothesis]), 1.0
    sizes = np.arange(step / 2, 80.0, step)
    levels = np.array([task.seen(Point(claim.hypothesis, np.array([size]))).level for size in sizes])
    top = levels.max()
    whole = top + np.log(np.sum(np.exp(levels - top) * slab.density(sizes[:, None])[:, 0]) * step)
    assert found.gain == pytest.approx(whole - task.level, abs=0.5)
