"""Words explained, and schemas that accept the files that come with the workbench."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.effects.catalogue import catalogue
from discovery.effects.reading import gives
from discovery.firsthour.schemas import schema
from discovery.terms import names, parse

ROOT = Path(__file__).parents[2]
FILES = [
    ("campaign", ROOT / "datasets/tclab/campaign.toml"),
    ("campaign", ROOT / "datasets/nmv5000/campaign.toml"),
    ("model", ROOT / "datasets/nmv5000/thermobalance.toml"),
    ("experiment", ROOT / "experiments/nmv5000.toml"),
    ("experiment", ROOT / "experiments/tclab.toml"),
]


@pytest.mark.parametrize("word", sorted(catalogue()))
def test_every_effect_is_explained(word: str) -> None:
    result = CliRunner().invoke(app, ["explain", word])
    effect = catalogue()[word]
    assert result.exit_code == 0
    for part in (effect.title, effect.formula, effect.signature, effect.source, *effect.confused_with):
        assert part in result.output


@pytest.mark.parametrize("key", sorted(catalogue()))
def test_a_formula_can_be_read_alone(key: str) -> None:
    """Every name of the formula has a meaning, and each example says what held before."""
    effect = catalogue()[key]
    output = CliRunner().invoke(app, ["explain", effect.word]).output
    own = {effect.amplitude.name, *(shape.name for shape in effect.shapes)}
    for name in names(parse(effect.formula)) - own:
        assert f" {name}: " in output
    for name, value in (pair for example in effect.examples for pair in example.before.items()):
        assert re.search(rf"before that .*{name} = {value:g}\b", output)


def test_the_flooded_gap_says_what_there_is_without_it() -> None:
    output = CliRunner().invoke(app, ["explain", "flooded_gap"]).output
    assert "a heat flow in W into body and out of other, added to all heat flows that the model has" in output
    assert "flow = 0, t_gap = 600, other = 25, body = 22 for 600 s, before that flow = 1: 44.15 W" in output
    (rings,) = [e for e in catalogue().values() if e.place == "driven and another"]
    assert "out of other" not in gives(rings)  # the heat of friction leaves no body


def test_a_mistaken_word_is_told_the_nearest() -> None:
    result = CliRunner().invoke(app, ["explain", "floded_gap"])
    assert result.exit_code == 2
    assert "did you mean 'flooded_gap'?" in result.stderr


@pytest.mark.parametrize(
    ("verb", "said"),
    [("list", "'foo' cannot be listed"), ("schema", "there is no schema of 'foo'"), ("explain", "no effect")],
)
def test_a_word_that_no_verb_knows_is_wrong_usage(verb: str, said: str) -> None:
    result = CliRunner().invoke(app, [verb, "foo"])
    assert (result.exit_code, said in result.stderr) == (2, True)


@pytest.mark.parametrize(
    ("what", "word"),
    [("effects", "flooded_gap"), ("models", "superposition"), ("roles", "coolant temperature")],
)
def test_lists(what: str, word: str) -> None:
    result = CliRunner().invoke(app, ["list", what])
    assert result.exit_code == 0
    assert word in result.output


def test_no_two_lines_of_effects_are_the_same() -> None:
    lines = CliRunner().invoke(app, ["list", "effects"]).output.splitlines()
    assert len(set(lines)) == len(lines)


def test_a_heat_load_may_be_in_percent() -> None:
    lines = CliRunner().invoke(app, ["list", "roles"]).output.splitlines()
    assert next(line for line in lines if line.startswith("heat load")).split()[2:5] == ["W", "or", "percent"]


def test_the_roles_say_which_liquid_may_dry_on_a_part() -> None:
    """The fluid of a solar collector was given the role of a cutting fluid, and "evaporation" was named."""
    said = CliRunner().invoke(app, ["list", "roles"]).output
    lines = {line[:20].strip(): line for line in said.splitlines()}
    assert "wets parts from outside" in lines["fluid temperature"]
    assert "in pipes or channels" in lines["coolant temperature"]


@pytest.mark.parametrize(("kind", "path"), FILES, ids=lambda value: getattr(value, "stem", value))
def test_schemas_accept_our_files(kind: str, path: Path) -> None:
    document = json.loads(schema(kind))
    jsonschema.Draft202012Validator.check_schema(document)
    data = tomllib.loads(path.read_text("utf-8"))
    jsonschema.validate(data, document)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data | {"misspelt": 1}, document)


def test_the_schema_of_campaigns_knows_what_a_correction_corrects() -> None:
    data = tomllib.loads((ROOT / "datasets/nmv5000/campaign.toml").read_text("utf-8"))
    applied = {"role": "applied correction", "unit": "um", "corrects": "E_Y0C", "sign": -1}
    document = json.loads(schema("campaign"))
    jsonschema.validate(data | {"channels": data["channels"] | {"applied": applied}}, document)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data | {"channels": {"applied": applied | {"sign": 2}}}, document)
