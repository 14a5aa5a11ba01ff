"""PLCopen XML holds the whole text, SCL is read back and replayed."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from discovery.export.identifiers import identifiers
from discovery.export.ranges import sampled_inputs
from discovery.export.replay import make_reference
from discovery.export.st import plcopen_text, prove_st, scl_text, st_name, st_text
from discovery.export.st.reader import read_structured_text
from discovery.export.st.units import units
from tests.export.conftest import make_campaign, make_model
from tests.export.guarded import by_the_runtime, faulty
from tests.export.test_guarded_c import sealed

TC6 = "{http://www.plcopen.org/xml/tc6_0201}"


def test_every_unit_and_variable_stands_in_the_xml() -> None:
    exported = sealed(make_model(), make_campaign())
    parts = units(st_text(exported))
    assert len(parts) == st_text(exported).count("\nEND_FUNCTION")
    root = ElementTree.fromstring(plcopen_text(exported))
    pous = root.findall(f".//{TC6}pou")
    assert [pou.get("name") for pou in pous] == [unit.name for unit in parts]
    for pou, unit in zip(pous, parts, strict=True):
        names = [v.get("name") for v in pou.findall(f".//{TC6}variable")]
        assert names == [
            v.name for s in ("VAR_INPUT", "VAR_OUTPUT", "VAR") for v in unit.variables if v.section == s
        ]
        body = "".join(pou.find(f".//{TC6}ST").itertext())  # type: ignore[union-attr]
        assert body == unit.body


def test_scl_guards_as_the_runtime_does() -> None:
    """Read back: names without #, arguments in the order of their names."""
    campaign = make_campaign(hours=3.0, seed=4)
    exported = sealed(make_model(), campaign)
    inputs = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)[:500]
    text = scl_text(exported)
    for name in ("ST_LREAL", "EXPT"):
        assert name not in text
    given = faulty(exported, inputs, 1, episodes=10)
    given.age[:] = 0.0
    offsets, status, _ = by_the_runtime(exported, given)
    block = read_structured_text(text)[st_name(exported)]
    scope, words = block.scope(), identifiers(exported.compiled.inputs)
    outs = [f"offset_{word}" for word in identifiers([o.name for o in exported.outputs])]
    for k, (enabled, done, acknowledge) in enumerate(given.switches.tolist()):
        scope |= {f"in_{w}": float(v) for w, v in zip(words, given.value[k], strict=True)}
        scope |= {f"ok_{w}": bool(v) for w, v in zip(words, given.good[k], strict=True)}
        scope |= {"enable": enabled, "part_done": done, "acknowledge": acknowledge}
        block.run(scope)
        assert scope["status"] == status[k], k
        assert [scope[name] for name in outs] == pytest.approx(offsets[k].tolist(), abs=1e-9)


def test_scl_follows_the_rules_of_siemens() -> None:
    exported = sealed(make_model(), make_campaign())
    text = scl_text(exported)
    name = st_name(exported)
    assert f'FUNCTION_BLOCK "{name}"' in text
    assert "VERSION : 0.1" in text
    assert f'guard_T_env : "{name}_GUARD";' in text
    assert "#guard_T_env(reading := #in_T_env, good := #ok_T_env" in text
    assert "SEL(G := " in text
    assert " ** " in text
    body = text[text.index("BEGIN", text.index(f'FUNCTION_BLOCK "{name}"')) :]
    assert "out_E_Z0T" in body
    assert not np.any([f" {word} :=" in body for word in ("v1", "gain", "mode", "status")])
    reference = make_reference(
        exported.compiled, sampled_inputs(make_campaign(), "fit", exported.compiled.inputs, 10.0)
    )
    assert all("SCL" in str(proof) for proof in prove_st(exported, reference, scl_text))
