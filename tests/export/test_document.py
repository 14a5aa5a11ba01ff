"""The document: whole, checked before it is used, refused when it was touched."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from discovery.errors import UserError
from discovery.export.compiled import compile_model
from discovery.export.document import _schema, from_document, read_document, render, write_document
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.seal import Seal, open_seal, private_key, public_key, require_trusted
from discovery.export.stepper import Stepper
from discovery.models import Model, Parameter, State, expanded
from discovery.models.model import with_settled_memories
from discovery.recordings import Campaign
from discovery.terms import Term, parse


@pytest.fixture
def document(model: Model, campaign: Campaign) -> dict[str, Any]:
    return make_document(model, campaign, ["fit"], 10.0, {"experiment": "small"})


def test_a_body_keeps_its_heat_capacity(document: dict[str, Any], model: Model) -> None:
    """Without it an effect would be a rate, with no usual size in W."""
    back = from_document(*open_seal(render(document), "model"), "model").model
    assert {n: s.capacity for n, s in back.states.items()} == {
        n: s.capacity for n, s in with_settled_memories(expanded(model)).states.items()
    }
    assert any(s.capacity for s in back.states.values())


def test_what_is_written_is_read_back_and_steps_the_same(
    document: dict[str, Any], model: Model, campaign: Campaign, tmp_path: Path
) -> None:
    write_document(tmp_path / "model.json", document)
    back = read_document(tmp_path / "model.json")
    u = sampled_inputs(campaign, "fit", back.compiled.inputs, 10.0)
    runs = []
    for compiled in (compile_model(with_settled_memories(expanded(model)), 10.0), back.compiled):
        stepper = Stepper(compiled)
        stepper.start(u[0])
        runs.append(stepper.run(u))
    assert np.array_equal(runs[0], runs[1])
    assert [name for name, state in back.model.states.items() if state.memory] == ["lag_1"]
    assert back.provenance["experiment"] == "small"
    assert [(i.name, i.role, i.unit) for i in back.inputs][:2] == [
        ("P_drive", "heat load", "W"),
        ("T_env", "ambient temperature", "degC"),
    ]


def test_parameters_come_back_with_their_bounds(model: Model, campaign: Campaign) -> None:
    given = {
        "G": Parameter(24.0, "W/K", 1.0, 50.0, low=20.0, high=28.0),
        "hA": Parameter(4.0, "W/K", 0.0, fixed=True),
        "m": Parameter(0.3, max=2.0),
    }
    model = replace(model, parameters={**model.parameters, **given})
    back = from_document(make_document(model, campaign, ["fit"]), Seal("", None, None), "m").model
    assert {name: back.parameters[name] for name in given} == given


def test_a_channel_that_only_a_start_names_is_an_input() -> None:
    states = {"y": State("y", "um", None, parse("T_env + T_fluid"), 0.0, 1.0)}
    model = Model("m", {}, states, (Term("t", "y", parse("T_env - y")),), {"E_Z0T": parse("y")})
    compiled = compile_model(model, 10.0)
    assert compiled.inputs == ("T_env", "T_fluid")
    stepper = Stepper(compiled)
    stepper.start(np.array([20.0, 3.0]))
    assert stepper.x[0] == 23.0


def test_a_play_begins_where_its_body_does() -> None:
    """At rest the joint shows what the body is at, 10, not what is left of its way there from zero."""
    states = {"y": State("y", "um", None, parse("T_env/2"), 0.0, 1.0)}
    model = Model("m", {}, states, (Term("t", "y", parse("0*T_env")),), {"E_Z0T": parse("play(y, 2)")})
    stepper = Stepper(compile_model(model, 10.0))
    stepper.start(np.array([20.0]))
    assert stepper.run(np.full((3, 1), 20.0)).tolist() == [[10.0]] * 3


def test_ranges_and_limits_come_from_the_recordings(document: dict[str, Any], campaign: Campaign) -> None:
    data = campaign.recordings["fit"].values
    for entry in document["inputs"]:
        series = data[entry["name"]]
        assert (entry["low"], entry["high"]) == (series.min(), series.max())
        assert entry["plausible_low"] <= entry["low"]
        assert (entry["step"] is None) == (entry["between"] == "held")
        if entry["step"] is not None:
            assert entry["step"] >= np.max(np.abs(np.diff(series)))
    assert all(o["limit"] > 0 and o["rate"] > 0 for o in document["outputs"])


@settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(share=some.floats(0, 1, exclude_max=True), byte=some.integers(0, 255))
def test_a_changed_byte_is_never_accepted(
    document: dict[str, Any], share: float, byte: int, tmp_path: Path
) -> None:
    data = bytearray(render(document, private_key(tmp_path / "key.pem")))
    end = data.rindex(b',\n "seal": ')
    place = int(share * end)
    if data[place] == byte:
        return
    data[place] = byte
    with pytest.raises(UserError, match=r"changed after it was sealed|no sealed model"):
        open_seal(bytes(data), "model.json")


def test_a_signature_of_someone_else_is_refused(document: dict[str, Any], tmp_path: Path) -> None:
    mine, other = private_key(tmp_path / "mine.pem"), private_key(tmp_path / "other.pem")
    data = render(document, mine)
    require_trusted(open_seal(data, "m")[1], public_key(tmp_path / "mine.pem.pub"), "m")
    forged = data.replace(
        mine.public_key().public_bytes_raw().hex().encode(),
        other.public_key().public_bytes_raw().hex().encode(),
    )
    with pytest.raises(UserError, match="signature is not that of its public key"):
        open_seal(forged, "m")
    with pytest.raises(UserError, match="not the trusted one"):
        require_trusted(open_seal(data, "m")[1], public_key(tmp_path / "other.pem.pub"), "m")
    assert (tmp_path / "mine.pem").stat().st_mode & 0o077 == 0


def altered(document: dict[str, Any], change: Any) -> dict[str, Any]:
    copy = json.loads(json.dumps(document))
    change(copy)
    return dict(copy)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            lambda d: d["terms"][0].update(expression="__import__('os').system('true')"),
            "not allowed|unknown function",
        ),
        (lambda d: d["terms"][0].update(expression="a.__class__"), "not allowed"),
        (lambda d: d["terms"][0].update(expression="(" * 3000), "not a formula"),
        (lambda d: d["terms"][0].update(expression="nobody*2"), "inputs listed are not those"),
        (lambda d: d["terms"][0].update(into="nowhere"), "state that is not listed"),
        (lambda d: d.update(version=2), "version 2 is not 1"),
        (lambda d: d.update(format="other"), "format 'other'"),
        (lambda d: d.update(step_s="10"), "step_s"),
        (lambda d: d.update(extra=1), "extra"),
        (lambda d: d["inputs"][0].update(name="x; DROP"), "inputs.0.name"),
        (lambda d: d["parameters"][0].pop("value"), "value"),
    ],
)
def test_mistakes_and_attacks_are_a_sentence(document: dict[str, Any], change: Any, sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        from_document(altered(document, change), Seal("", None, None), "model.json")


@pytest.mark.parametrize("wrong", [True, "1", None, [1.0], 1e301, -1e301])
def test_one_wrong_number_in_a_long_list_is_named(document: dict[str, Any], wrong: Any) -> None:
    """Lists of numbers are looked at as a whole; what is said is what the plain schema says."""
    jsonschema = pytest.importorskip("jsonschema")
    rows = [[1.0, 2, 0.0]] * 50
    sound = altered(document, lambda d: d["knowledge"].update(rows=rows))
    from_document(sound, Seal("", None, None), "model.json")
    bad = altered(sound, lambda d: d["knowledge"]["rows"][40].__setitem__(1, wrong))
    (plain,) = jsonschema.Draft202012Validator(_schema()).iter_errors(bad)
    with pytest.raises(UserError) as found:
        from_document(bad, Seal("", None, None), "model.json")
    assert (
        str(found.value) == f"model.json: key 'knowledge.rows.40.1': {plain.message}; export the model again"
    )


def test_a_tower_of_powers_ends_at_once(document: dict[str, Any]) -> None:
    towering = altered(document, lambda d: d["terms"][0].update(expression="9**9**9**9"))
    compiled = from_document(towering, Seal("", None, None), "model.json").compiled
    stepper, u = Stepper(compiled), np.full(len(compiled.inputs), 20.0)
    stepper.start(u)
    assert stepper.step(u) is None


@pytest.mark.parametrize("data", [b"", b"{}", b'{"a": 1,\n "seal": {}\n}\n', b"\xff\xfe", b"[1, 2]"])
def test_what_is_no_model_is_refused(data: bytes) -> None:
    with pytest.raises(UserError):
        open_seal(data, "x")


def test_a_key_that_stands_twice_or_is_no_number_is_refused() -> None:
    from discovery.export.seal import seal_bytes

    for body in (b'{"name": "a", "name": "b"\n}', b'{"name": NaN\n}', b'{"name": -Infinity\n}'):
        with pytest.raises(UserError, match="not valid JSON"):
            open_seal(seal_bytes(body), "x")
