"""Random models of the whole grammar: C and structured text against the Python reference."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from discovery.export.compiled import compile_model
from discovery.export.document import Exported
from discovery.export.replay import make_reference, prove_c
from discovery.export.seal import Seal
from discovery.export.st import prove_st
from discovery.models import Model, Parameter, State
from discovery.terms import Term, parse
from tests.export.conftest import needs_gcc

INPUTS = ("T_env", "T_fluid", "pump", "speed", "P_drive")
LOW, HIGH = np.array([20.0, 24.0, 0.0, 0.0, 0.0]), np.array([25.0, 30.0, 1.0, 1200.0, 800.0])

number = some.floats(0.1, 20.0).map(lambda x: round(x, 3))
share = some.floats(0.05, 1.5).map(lambda x: round(x, 3))


@some.composite
def heat(draw: some.DrawFn, here: str, other: str) -> str:
    """A heat flow into `here`, damped enough to be a machine."""
    g, p = draw(number), draw(share)
    return draw(
        some.sampled_from(
            [
                f"{g}*({other} - {here})",
                f"{g}*pump*(T_fluid - {here})",
                f"{g}*pump*where(speed > 300, (speed/600)**{p}, {p})*(T_fluid - {here})",
                f"{g}*abs(T_env - {here})**{p}*sign(T_env - {here})",
                f"{p}*P_drive",
                f"{p}*lag(P_drive, {600 * g})",
                f"{g}*(delay(T_fluid, {37 * g}) - {here})",
                f"{g}*play({other} - {here}, {p})",
                f"{g}*tanh(({other} - {here})/{p})",
                f"{p}*P_drive*exp(-0.03*({here} - 22))",
                f"{g}*sqrt(abs(speed))*min(T_env - {here}, 5, 3)",
                f"5.67e-8*{p}*((T_env + 273.15)**4 - ({here} + 273.15)**4)",
                f"{g}*log(1 + speed/{g})*(speed >= 600)*(22 <= {here} < 24)",
                f"{g}*(P_drive/(1 + speed) != 0)*max(T_fluid - {here}, -1)",
                f"{g}*(1 + (speed/{100 * g})**2)**(0 - 1)",
                f"{g}*{p}**({here}/20)",
                f"time*{p}*1e-4",
            ]
        )
    )


@some.composite
def models(draw: some.DrawFn) -> Model:
    """One to four bodies with two to four terms each, and two errors of a few hundred um."""
    names = [f"body_{k}" for k in range(draw(some.integers(1, 4)))]
    states = {
        name: State(
            name,
            "degC",
            1e4,
            parse(draw(some.sampled_from(["T_env", "22", "0.5*(T_env + T_fluid)"]))),
            0.5,
            1 / draw(some.floats(1e4, 3e5)),
        )
        for name in names
    }
    terms = []
    for name in names:
        terms.append(Term("air", name, parse(f"{draw(number)}*(T_env - {name})")))
        for _ in range(draw(some.integers(1, 3))):
            other = draw(some.sampled_from([*names, "T_env"]))
            source = other if other in names and other != name else None
            terms.append(Term("t", name, parse(draw(heat(name, other))), source))
    outputs = {
        "E_Z0T": parse(" + ".join(f"{draw(share)}*({name} - 22)" for name in names)),
        "E_A0C": parse(f"{draw(share)}*play({names[0]} - 22, 0.2) + 0.01*P_drive - k*delay(T_env, 33)"),
    }
    return Model(
        draw(some.sampled_from(["plain", "a */ b", "Öl"])),
        {"k": Parameter(draw(share))},
        states,
        tuple(terms),
        outputs,
    )


def exported(model: Model, step_s: float) -> Exported:
    from discovery.export.document import Input, Output
    from discovery.export.ranges import InputRange, OutputRange

    compiled = compile_model(model, step_s)
    inputs = tuple(
        Input(n, "other input", "1", "held", InputRange(0, 1, 0, 1, None, None, 1)) for n in compiled.inputs
    )
    outputs = tuple(Output(n, "error", "um", OutputRange(1, 1)) for n in compiled.outputs)
    return Exported(model, compiled, inputs, outputs, 1, {}, (), {}, Seal("0" * 64, None, None))


def random_inputs(names: tuple[str, ...], steps: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(LOW, HIGH, size=(steps // 20 + 1, 5)), 20, axis=0)[:steps]
    u[:, 2] = np.round(u[:, 2])
    return u[:, [INPUTS.index(name) for name in names]]


@needs_gcc
@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(models(), some.sampled_from([1.0, 10.0, 60.0]), some.integers(0, 1000))
def test_c_in_double_and_float_is_the_python_model(model: Model, step_s: float, seed: int) -> None:
    one = exported(model, step_s)
    reference = make_reference(one.compiled, random_inputs(one.compiled.inputs, 2000, seed))
    proofs = {
        proof.target: proof.deviation for proof in prove_c(one, reference)
    }  # raises above 1e-9 and 1e-3
    assert set(proofs) == {"C double", "C float"}


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(models(), some.sampled_from([1.0, 10.0, 60.0]), some.integers(0, 1000))
def test_structured_text_is_the_python_model(model: Model, step_s: float, seed: int) -> None:
    one = exported(model, step_s)
    reference = make_reference(one.compiled, random_inputs(one.compiled.inputs, 200, seed))
    assert len(prove_st(one, reference)) == 2


@needs_gcc
def test_the_size_of_the_temporary_folder_is_given_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder of its own: other proofs may run at the same time."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    one = exported(Model("x", {}, {"x": State("x")}, (), {"y": parse("x")}), 1.0)
    prove_c(one, make_reference(one.compiled, np.zeros((5, 0))))
    assert not list(tmp_path.iterdir())
