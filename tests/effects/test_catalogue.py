"""The contract of the catalogue: a new effect is tested by being there."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from math import exp, isclose
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import truncnorm

from discovery.dynamics import predict
from discovery.effects.catalogue import Effect, Shape, catalogue
from discovery.effects.form import INPUT, LEVEL, RATE, ROLE_OF, TERM, TERM_PLACES
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.worked import worked
from discovery.models import Model, read_model, write_model
from discovery.models.dimensions import check_dimensions
from discovery.recordings.roles import ROLES
from discovery.terms import names, parse
from tests.effects.sample import RUNS, expand, inside, machine_for, sample, trajectory

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
    "air body": "ambient temperature",
    "fluid terms": "fluid temperature",
    "cooling terms": "cooling power",
    "current terms": "other input",
    "air terms": "ambient temperature",
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
    return inside(h).added_to(machine_for(h.effect), dict.fromkeys(h.amplitudes, size))


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
    assert all(role in ROLES for role in effect.roles)
    file = next(name for name, e in catalogue().items() if e is effect)
    said = import_module(f"discovery.effects.catalogue.{file}").__doc__ or ""
    said = " ".join(said.split())
    assert "Source:" in said
    assert "Limits:" in said
    assert ("at 1000 rpm" in said) == (effect.at == "1000 rpm")  # what the formula divides the speed by


@entries
def test_names_in_the_formula_mean_something(effect: Effect) -> None:
    own = {effect.amplitude.name} | {s.name for s in effect.shapes}
    known = own | set(ROLE_OF) | {"body", "other", "y", "time", INPUT, LEVEL, RATE, TERM}
    used = names(parse(effect.formula))
    assert used <= known
    assert {s.name for s in effect.shapes} <= used
    assert effect.amplitude.name in used or effect.place in (*TERM_PLACES, "inputs of a recording")
    replaced = effect.place in (*TERM_PLACES, "inputs of a recording")  # `input` is the channel there
    follows_any = LEVEL in used or (INPUT in used and not replaced)
    assert bool(effect.roles) == follows_any  # without roles such an entry is offered nowhere


@entries
def test_worked_examples_hold(effect: Effect) -> None:
    for example in effect.examples:
        assert isclose(worked(effect.formula, example), example.expected, rel_tol=5e-4)


@entries
def test_a_formula_is_linear_in_its_amplitude_and_zero_at_zero(effect: Effect) -> None:
    name, seen = effect.amplitude.name, []
    for example in effect.examples:
        if name not in example.values:
            continue  # on or off: tested by simulation below
        at = [
            worked(effect.formula, replace(example, values={**example.values, name: a}))
            for a in (0.0, 1.0, -2.5)
        ]
        replaced = effect.place in TERM_PLACES and TERM not in names(parse(effect.formula))
        plain = example.values["fluid" if "fluid" in example.values else INPUT] if replaced else 0.0
        assert at[0] == plain
        assert isclose(at[2] - plain, -2.5 * (at[1] - plain), rel_tol=1e-12)
        seen.append(at[1] - plain)
    assert any(seen) or not any(name in example.values for example in effect.examples)


@entries
def test_a_size_and_its_shapes_have_priors(effect: Effect) -> None:
    assert effect.amplitude.plausible > 0
    for shape in (s.within(60.0, 86400.0) for s in effect.shapes):
        assert shape.instant + bool(shape.factor > 1) + bool(shape.spread > 0) == 1
        low, high = shape.ends
        weights = [weight for _, weight in shape.values]
        assert all(low <= value <= high for value, _ in shape.values)
        assert isclose(sum(map(exp, weights)), 1.0)


def test_values_of_a_shape_integrate_its_prior() -> None:
    """Mean and spread (of a factor: of the logarithm) are those of a normal cut at two deviations."""
    cut = truncnorm(-2.0, 2.0)
    for shape in (Shape("t", "s", 1800.0, factor=6.0), Shape("dT", "K", 1.0, spread=3.0)):
        x = np.array([value for value, _ in shape.values])
        w = np.exp([weight for _, weight in shape.values])
        z = np.log(x / 1800.0) / np.log(6.0) if shape.factor else (x - 1.0) / 3.0
        assert isclose(w @ z, 0.0, abs_tol=1e-9)
        assert isclose(np.sqrt(w @ z**2), cut.std(), rel_tol=0.2)


def test_a_shift_may_be_small() -> None:
    """An effect without a size is as small as its shape: values down to a thirtieth of its spread."""
    values = [value for value, _ in Shape("t_shift", "s", 0.0, spread=1800.0).values if value > 0]
    assert min(values) < 1800.0 / 30
    assert max(np.diff(np.log(values))) < np.log(3.1)
    assert max(values) > 1800.0


def test_a_time_without_a_middle_is_any_that_the_recordings_show() -> None:
    shape = Shape("t_m", "s", None).within(30.0, 86400.0)
    values = [value for value, _ in shape.values]
    assert isclose(min(values), 30.0, rel_tol=1e-9)
    assert isclose(max(values), 86400.0, rel_tol=1e-9)
    assert shape.ends == (min(values), max(values))  # in two days, a mass of 462 h looks like a drift
    assert max(np.diff(np.log(values))) < np.log(3.1)  # neighbours are much alike
    given = Shape("t_b", "s", 120000.0, factor=1.6)
    assert given.within(30.0, 600.0) == given  # a bed keeps its time constants or is no bed


def test_a_clock_is_off_by_no_more_than_a_part_of_a_recording() -> None:
    """Loggers are started within seconds for a test of minutes, and half an hour apart for one of days."""
    shift = Shape("t_shift", "s", 0.0, spread=1800.0)
    assert shift.within(2.0, 480.0).spread == pytest.approx(60.0)
    assert shift.within(300.0, 259200.0) == shift
    # readings of a computer in orbit, 720 s long, were said to come 900 s late
    late = Shape("t_shift", "s", 900.0, factor=2.2, is_shift=True)
    assert late.within(12.0, 720.0).middle == pytest.approx(90.0)
    assert late.within(300.0, 259200.0) == late
    exponent = Shape("m", "1", 0.0, spread=0.5)
    assert exponent.within(2.0, 1.0) == exponent


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
    model, channels = machine_for(effect), sample()[1]
    assert check_dimensions(model, channels) == []
    for h in expand(effect):
        if "**m_flow" in effect.formula.replace(" ", ""):
            continue  # it has a unit only where flow is a pure number
        assert check_dimensions(h.added_to(model), channels) == []


@entries
def test_the_extended_model_is_written_read_and_simulated(effect: Effect, tmp_path: Path) -> None:
    bare = machine_for(effect)
    baseline, seen = run(bare), []
    for h in {h.key: h for h in expand(effect)}.values():
        off, on = switched(h, 0.0), switched(h, effect.amplitude.fixed or effect.amplitude.plausible)
        assert np.allclose(run(off), baseline, rtol=0, atol=1e-9)
        write_model(tmp_path / "m.toml", on)
        back = read_model(tmp_path / "m.toml")
        assert np.allclose(run(back), run(on), rtol=0, atol=1e-6)
        other = "one" if h.recording == "two" else "two"
        seen.append(np.abs(run(on, h.recording or other) - run(bare, h.recording or other)).max())
        for before in (name for name in RUNS if not h.acts_in(name)):  # recordings without it stay
            assert np.allclose(run(on, before), run(bare, before), rtol=0, atol=1e-9)
    assert np.isfinite(seen).all()
    assert max(seen) > 1e-3  # and acts where it should


@entries
def test_terms_carry_the_word(effect: Effect) -> None:
    for h in expand(effect):
        assert all(t.effect == effect.word for t in h.terms)
        assert h.terms or h.shown
        assert not (h.terms and h.shown)


@pytest.mark.parametrize("file", ["bed_memory", "bed_memory_night"])
def test_a_bed_takes_a_day_or_two(file: str) -> None:
    """68 % of beds within 20 to 60 h, and none within minutes: that would be another effect."""
    shape = catalogue()[file].shapes[0]
    assert shape.middle is not None
    assert 20.0 <= shape.middle / shape.factor / 3600 < shape.middle * shape.factor / 3600 <= 60.0
    assert min(value for value, _ in shape.values) > 10 * 3600.0
