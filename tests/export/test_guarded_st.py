"""The guards, limits and fades of structured text are those of the Python runtime, tick by tick."""

from __future__ import annotations

import pytest

from discovery.export.identifiers import identifiers
from discovery.export.ranges import sampled_inputs
from discovery.export.st import st_name, st_text
from discovery.export.st.reader import read_structured_text
from discovery.models import Model
from tests.export.conftest import make_campaign, make_model
from tests.export.guarded import by_the_runtime, faulty
from tests.export.test_guarded_c import failing, quiet, sealed


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("model", [make_model(), failing()], ids=["everything", "failing"])
def test_the_block_guards_as_the_runtime_does(model: Model, seed: int) -> None:
    campaign = make_campaign(hours=6.0, seed=3)
    campaign = quiet(campaign)
    exported = sealed(model, campaign)
    inputs = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)[:1200]
    given = faulty(exported, inputs, seed, episodes=20)
    given.age[:] = 0.0  # a block in a PLC reads its inputs now
    offsets, status, gains = by_the_runtime(exported, given)
    block = read_structured_text(st_text(exported))[st_name(exported)]
    scope = block.scope()
    words = identifiers(exported.compiled.inputs)
    outs = [f"offset_{word}" for word in identifiers([o.name for o in exported.outputs if o.role == "error"])]
    for k, (enabled, done, acknowledge) in enumerate(given.switches.tolist()):
        scope |= {f"in_{w}": float(v) for w, v in zip(words, given.value[k], strict=True)}
        scope |= {f"ok_{w}": bool(v) for w, v in zip(words, given.good[k], strict=True)}
        scope |= {"enable": enabled, "part_done": done, "acknowledge": acknowledge}
        block.run(scope)
        assert scope["status"] == status[k], k
        assert scope["gain"] == pytest.approx(gains[k], abs=1e-12)
        assert [scope[name] for name in outs] == pytest.approx(offsets[k].tolist(), abs=1e-9)
    assert len({int(word) & 0xFF for word in status}) >= 3


def test_a_parameter_is_set_by_its_number() -> None:
    exported = sealed(make_model(), make_campaign())
    text = st_text(exported)
    assert "par_G : LREAL; (* 1: G [1]: conduction *)" in text
    assert text.count("(* conduction: ") == 1
    block = read_structured_text(text)[st_name(exported)]
    scope = block.scope()
    scope |= {f"in_{word}": 22.0 for word in identifiers(exported.compiled.inputs)}
    block.run(scope)
    assert scope["par_G"] == 24.0
    scope |= {"set_parameter": 1, "set_value": 30.0}
    block.run(scope)
    scope |= {"set_parameter": 0, "set_value": 0.0}
    block.run(scope)
    assert scope["par_G"] == 30.0
