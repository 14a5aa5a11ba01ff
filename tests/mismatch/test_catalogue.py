"""The contract of the catalogue: a new effect is tested by being there."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from math import isclose
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis.scales import scaled
from discovery.dynamics.system import predict
from discovery.effects.catalogue import Effect, catalogue
from discovery.effects.form import ROLE_OF
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.worked import worked
from discovery.models import Model, read_model, write_model
from discovery.models.dimensions import check_dimensions
from discovery.recordings.roles import ROLES
from discovery.terms import names, parse
from tests.mismatch.sample import expand, inside, sample, trajectory

Array = NDArray[np.float64]

# Section 4 of the list of words that users rely on, by group
WORDS = {
    "cutting fluid": "fluid_convection fluid_convection_flow fluid_convection_speed rim_detachment "
    "evaporation_drying film_drag flooded_gap fluid_delay fluid_sump swarf_heat",
    "drive and cooling": "friction_speed viscosity_temperature thermal_preload copper_resistance windage "
    "cooling_hysteresis wear",
    "air and structure": "rotating_air_convection natural_convection radiation air_convection "
    "conduction_path second_thermal_mass bed_memory joint_hysteresis contact_conductance unmeasured_heat",
    "measuring chain": "sensor_offset sensor_drift sensor_lag outlier clock_shift rezero",
}
GROUP_OF = {word: group for group, words in WORDS.items() for word in words.split()}

# What a place needs in the model besides the roles of the formula
PLACE_NEEDS = {
    "wet body": "fluid temperature",
    "speed-driven body": "rotation speed",
    "air body": "ambient temperature",
    "fluid terms": "fluid temperature",
    "cooling terms": "cooling power",
}

entries = pytest.mark.parametrize("effect", catalogue().values(), ids=list(catalogue()))


def needs(effect: Effect) -> set[str]:
    """Roles without which an effect cannot act."""
    roles = {ROLE_OF[n] for n in names(parse(effect.formula)) if n in ROLE_OF}
    return roles | ({PLACE_NEEDS[effect.place]} if effect.place in PLACE_NEEDS else set())


def run(model: Model, recording: str = "two") -> Array:
    return predict(trajectory(model, recording))


def switched(h: Hypothesis, size: float) -> Model:
    """The sample model with an effect of a size (in every recording that it concerns)."""
    return inside(h).added_to(sample()[0], dict.fromkeys(h.amplitudes, size))


def test_every_word_has_an_entry_in_its_group() -> None:
    """Others may stand beside them: an effect is added with one file and nothing else."""
    assert GROUP_OF.items() <= {e.word: e.group for e in catalogue().values()}.items()
    assert set(GROUP_OF) <= set(catalogue())


@entries
def test_an_entry_is_complete(effect: Effect) -> None:
    assert effect.title
    assert len(effect.source) > 10
    assert len(effect.signature) > 10
    assert effect.examples
    assert set(effect.confused_with) <= set(catalogue()) - {effect.word}
    assert all(ROLE_OF[n] in ROLES for n in names(parse(effect.formula)) if n in ROLE_OF)
    assert 0 < effect.prior <= 1
    file = next(name for name, e in catalogue().items() if e is effect)
    said = import_module(f"discovery.effects.catalogue.{file}").__doc__ or ""
    assert "Source:" in said
    assert "Limits:" in said
    assert ("at 1000 rpm" in said) == (effect.at == "1000 rpm")  # what the formula divides the speed by


@entries
def test_names_in_the_formula_mean_something(effect: Effect) -> None:
    own = {effect.amplitude.name} | {s.name for s in effect.shapes}
    known = own | set(ROLE_OF) | {"body", "other", "y", "time", "input"}
    used = names(parse(effect.formula))
    assert used <= known
    assert {s.name for s in effect.shapes} <= used
    assert effect.amplitude.name in used or effect.place in (
        "fluid terms",
        "cooling terms",
        "inputs of a recording",
    )


@entries
def test_worked_examples_hold(effect: Effect) -> None:
    for example in effect.examples:
        assert isclose(worked(effect.formula, example), example.expected, rel_tol=5e-4)


@entries
def test_a_formula_is_linear_in_its_amplitude_and_zero_at_zero(effect: Effect) -> None:
    name = effect.amplitude.name
    for example in effect.examples:
        if name not in example.values:
            continue  # on or off: tested by simulation below
        at = [
            worked(effect.formula, replace(example, values={**example.values, name: a}))
            for a in (0.0, 1.0, -2.5)
        ]
        plain = example.values["fluid"] if effect.place == "fluid terms" else 0.0
        assert at[0] == plain
        assert at[1] != plain
        assert isclose(at[2] - plain, -2.5 * (at[1] - plain), rel_tol=1e-12)


@entries
def test_grids_lie_inside_their_bounds(effect: Effect) -> None:
    assert effect.amplitude.plausible > 0
    for shape in effect.shapes:
        assert len(shape.grid) == len(set(shape.grid)) > 0
        assert all(shape.low <= value <= shape.high for value in shape.grid)


@entries
def test_an_effect_is_offered_where_its_roles_are_and_nowhere_else(effect: Effect) -> None:
    found = expand(effect)
    assert found
    assert len({(h.key, tuple(h.shapes.values())) for h in found}) == len(found)
    claims = {h.key: h for h in found}.values()
    amplitudes = [a for h in claims for a in h.amplitudes]
    assert len(set(amplitudes)) == len(amplitudes)
    for role in needs(effect):
        assert expand(effect, without={role}) == []


@entries
def test_units_fit(effect: Effect) -> None:
    model, channels = sample()
    assert check_dimensions(model, channels) == []
    for h in expand(effect):
        if effect.word == "fluid_convection_flow":
            continue  # flow**m has a unit only where flow is a pure number
        assert check_dimensions(h.added_to(model), channels) == []


@entries
def test_the_extended_model_is_written_read_and_simulated(effect: Effect, tmp_path: Path) -> None:
    baseline, seen = run(sample()[0]), []
    for h in {h.key: h for h in expand(effect)}.values():
        off, on = switched(h, 0.0), switched(h, effect.amplitude.fixed or effect.amplitude.plausible)
        assert np.allclose(run(off), baseline, rtol=0, atol=1e-9)
        write_model(tmp_path / "m.toml", on)
        back = read_model(tmp_path / "m.toml")
        assert np.allclose(run(back), run(on), rtol=0, atol=1e-6)
        other = "one" if h.recording == "two" else "two"
        seen.append(np.abs(run(on, h.recording or other) - run(sample()[0], h.recording or other)).max())
        if h.recording:  # what belongs to one recording leaves the others alone
            assert np.allclose(run(on, other), run(sample()[0], other), rtol=0, atol=1e-9)
    assert np.isfinite(seen).all()
    assert max(seen) > 1e-3  # and acts where it should


@entries
def test_terms_carry_the_word(effect: Effect) -> None:
    for h in expand(effect):
        assert all(t.effect == effect.word for t in h.terms)
        assert h.terms or h.shown
        assert not (h.terms and h.shown)


def test_slow_masses_are_those_of_what_was_recorded_for_weeks() -> None:
    """Three days change nothing; walls that are recorded for twelve days may take a day."""
    mass, lag = catalogue()["second_thermal_mass"], catalogue()["sensor_lag"]
    assert scaled(mass, 72 * 3600.0) == mass
    (shape,) = scaled(mass, 12 * 86400.0).shapes
    assert shape.high == 3 * mass.shapes[0].high
    assert max(shape.grid) == shape.high / 3
    assert scaled(lag, 12 * 86400.0) == lag


def test_short_recordings_have_short_masses_and_no_late_clocks() -> None:
    """Ten minutes: a mass of 10 s may be what was recorded, a clock is off by no more than a minute."""
    (plain,) = catalogue()["second_thermal_mass"].shapes
    (mass,) = scaled(catalogue()["second_thermal_mass"], 600.0).shapes
    assert (mass.low, mass.high, mass.grid) == (10.0, plain.high, (30.0, *plain.grid))
    (clock,) = scaled(catalogue()["clock_shift"], 600.0).shapes
    assert (clock.low, clock.high, clock.grid) == (-60.0, 60.0, (-30.0, 30.0))


def test_of_a_clock_only_the_shifts_are_tried_that_fit_a_recording() -> None:
    (clock,) = scaled(catalogue()["clock_shift"], 9000.0).shapes
    assert (clock.low, clock.high, clock.grid) == (-900.0, 900.0, (-900.0, -300.0, 300.0, 900.0))
    (plain,) = catalogue()["clock_shift"].shapes
    assert scaled(catalogue()["clock_shift"], 72 * 3600.0).shapes == (plain,)


@entries
def test_what_is_no_time_does_not_depend_on_how_long_was_recorded(effect: Effect) -> None:
    for shape, other in zip(effect.shapes, scaled(effect, 60.0).shapes, strict=True):
        assert (shape == other) == (shape.unit != "s" or shape.fixed or 0 <= shape.low <= 1.0)
