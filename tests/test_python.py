"""Python as people expect: names that complete, mistakes that help, results that show themselves."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

import discovery
from discovery.diagnosis import Diagnosis
from discovery.errors import UserError
from discovery.fitting import Fit
from discovery.recordings import Campaign
from tests import machine

ROOT = Path(__file__).parents[1]
FIT, HELD_OUT, OUTPUTS = "random_both_01", "step_h1_up_050", ["T1", "T2"]


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return discovery.load_campaign(ROOT / "datasets" / "tclab", only=[FIT, HELD_OUT])


@pytest.fixture(scope="module")
def fit(campaign: Campaign) -> Fit:
    model = discovery.read_model(ROOT / "experiments" / "tclab_first_order.toml")
    return discovery.fit_model(model, campaign, [FIT], OUTPUTS)


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    """What a small simulated machine shows: of the heaters, it takes five times as long."""
    recordings = machine.campaign(machine.simulated(1), machine.simulated(2))
    return discovery.diagnose(machine.model(linked=False), recordings, ["r1"], ["r2"], list(machine.SEEN))


def test_every_public_name_is_listed_and_loads() -> None:
    assert set(discovery.__all__) <= set(dir(discovery))
    for name in dir(discovery):
        assert getattr(discovery, name) is not None


def test_a_wrong_name_of_the_package_is_answered_with_the_right_one() -> None:
    with pytest.raises(AttributeError, match="did you mean 'fit_model'"):
        _ = discovery.fit_modle
    assert not hasattr(discovery, "__wrapped__")


def test_wrong_names_of_recordings_and_channels_are_sentences(campaign: Campaign) -> None:
    model = discovery.read_model(ROOT / "experiments" / "tclab_first_order.toml")
    with pytest.raises(UserError, match="no recording 'random_both_1'; did you mean 'random_both_01'"):
        discovery.fit_model(model, campaign, ["random_both_1"], OUTPUTS)
    with pytest.raises(UserError, match="did you mean 'step_h1_up_050'"):
        discovery.recording_frame(campaign, "step_h1_up_05")
    with pytest.raises(UserError, match="no channel 'T_1'; did you mean 'T1'"):
        discovery.fit_model(model, campaign, [FIT], ["T_1"])
    with pytest.raises(UserError, match="no channel 'T_1'; did you mean 'T1'"):
        discovery.prediction_frame(model, campaign, FIT, ["T_1"])
    with pytest.raises(UserError, match="did you mean"):
        discovery.diagnose(model, campaign, ["random_both_1"], [], OUTPUTS)


def test_a_campaign_survives_a_pickle(campaign: Campaign) -> None:
    again = pickle.loads(pickle.dumps(campaign))
    assert list(again.recordings) == [FIT, HELD_OUT]
    with pytest.raises(UserError, match="no recording 'x'"):
        _ = again.recordings["x"]


def test_a_fit_shows_itself(fit: Fit) -> None:
    frame = fit.to_frame()
    p = fit.model.parameters["b1"]
    assert frame.loc["b1", "value"] == p.value
    assert frame.loc["b1", "low"] == p.low
    left = fit.residuals()[FIT]
    assert f"T1 {np.sqrt(np.nanmean(left[:, 0] ** 2)):.3g}" in fit.summary()
    assert len(fit.plot().axes) == 2
    assert "b1" in fit._repr_html_()
    assert repr(fit) == fit.summary()  # all that it holds would be megabytes


def test_a_diagnosis_shows_itself(diagnosis: Diagnosis) -> None:
    document = diagnosis.document()
    frame = diagnosis.to_frame()
    assert set(frame["effect"]) == {p.effect for p in document.physics} == {"conduction_path"}
    assert diagnosis.summary().startswith(f"{document.verdict} in ")
    assert repr(diagnosis) == diagnosis.summary()
    bars = [bar.get_height() for bar in diagnosis.plot().axes[0].patches if isinstance(bar, Rectangle)]
    assert bars[0] == document.improvement.fit.rms_before
    assert re.search(r"\br2\b", diagnosis._repr_html_())


def test_a_run_shows_itself(tmp_path: Path) -> None:
    experiment = tmp_path / "experiment.toml"
    experiment.write_text(
        f'name = "one"\ncampaign = "{ROOT}/datasets/tclab"\nfit = ["{FIT}"]\nheld_out = ["{HELD_OUT}"]\n'
        f'outputs = ["T1", "T2"]\n[models.first]\nkind = "file"\n'
        f'file = "{ROOT}/experiments/tclab_first_order.toml"\n'
    )
    results = discovery.run(experiment, tmp_path / "out")
    assert results.report.exists()
    frame = results.to_frame()
    assert set(frame["model"]) == {"uncompensated", "first"}
    one = frame.query("recording == @HELD_OUT and model == 'first' and output == 'T1'").iloc[0]
    model = discovery.read_model(Path(results) / "models" / "first.toml")
    campaign = discovery.load_campaign(ROOT / "datasets" / "tclab", only=[HELD_OUT])
    fit = discovery.fit_model(
        discovery.read_model(ROOT / "experiments" / "tclab_first_order.toml"),
        discovery.load_campaign(ROOT / "datasets" / "tclab", only=[FIT]),
        [FIT],
        OUTPUTS,
    )
    left = discovery.prediction_frame(model, campaign, HELD_OUT, OUTPUTS, fit.zeros)["T1|left"]
    assert one["rms"] == pytest.approx(np.sqrt((left**2).mean()), rel=0.02)
    assert f"Recording '{HELD_OUT}' (held out)" in results.summary()
    assert len(results.plot().axes) == 2
    assert "first" in results._repr_html_()
    with pytest.raises(UserError, match="no recording 'x'"):
        results.plot("x")
    with pytest.raises(UserError, match=r"no results\.json there; name the folder of a finished"):
        discovery.RunResults(tmp_path)
