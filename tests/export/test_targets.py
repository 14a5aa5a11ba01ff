"""Targets of a model that uses everything: written, valid, equal, restorable."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.export import export_model
from discovery.export.identifiers import comment, identifiers
from discovery.export.st.proof import compiled
from discovery.export.st.reader import read_structured_text
from discovery.models import Model, State
from discovery.models.modelfile import write_model
from discovery.recordings import Campaign
from discovery.terms import Term, parse
from tests.export.conftest import HAS_GCC, make_campaign, make_model, needs_gcc


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not HAS_GCC:
        pytest.skip("no C compiler (gcc) is installed")
    place = tmp_path_factory.mktemp("export")
    done = export_model(make_model(), make_campaign(4.0), ["fit"], ["json", "c", "fmu", "fmu3", "st"], place)
    limits = {proof.target: (proof.deviation, proof.limit) for proof in done.proofs}
    assert set(limits) == {
        *("C double", "C float", "FMI 2.0", "FMI 3.0", "structured text LREAL", "structured text REAL")
    }
    assert all(found is not None and found <= limit for found, limit in limits.values())
    return place


@pytest.mark.parametrize(
    ("status", "said"), [(0, "compiled with iec2c"), (1, "iec2c refuses"), (None, "not compiled")]
)
def test_structured_text_is_compiled_where_a_compiler_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int | None, said: str
) -> None:
    """A stand-in that reads the file as a compiler would; real ones: `tests/export/outside`."""
    if status is not None:
        (tmp_path / "iec2c").write_text(
            f"#!/bin/sh\n/usr/bin/test -s model.st || exit 2\necho line 7\nexit {status}\n"
        )
        (tmp_path / "iec2c").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    if status:
        with pytest.raises(UserError, match=f"{said} the structured text: line 7"):
            compiled("PROGRAM x END_PROGRAM")
    else:
        assert said in compiled("PROGRAM x END_PROGRAM")


def test_the_c_files_stand_alone(folder: Path, tmp_path: Path) -> None:
    """As a user would: the shipped files alone, the strictest warnings, a sanitizer."""
    [source] = [p for p in (folder / "c").glob("*.c") if p.name != "replay.c"]
    strict = [
        "-std=c99",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-Wdouble-promotion",
        "-Werror",
        "-O1",
    ]
    for flags in ([], ["-DDISCOVERY_FLOAT"], ["-fsanitize=undefined", "-fno-sanitize-recover"]):
        program = tmp_path / "replay"
        subprocess.run(
            ["gcc", *strict, *flags, "replay.c", source.name, "-lm", "-o", program],
            cwd=folder / "c",
            check=True,
        )
        done = subprocess.run(
            [program, "reference_inputs.csv", "reference_outputs.csv"],
            cwd=folder / "c",
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
    text = source.read_text()
    assert "malloc" not in text


def test_the_replay_notices_a_wrong_number(folder: Path, tmp_path: Path) -> None:
    for file in (folder / "c").iterdir():
        content = file.read_text()
        if file.suffix == ".c" and file.name != "replay.c":
            assert "R(1.92)" in content
            content = content.replace("R(1.92)", "R(1.9200001)")
        (tmp_path / file.name).write_text(content)
    [source] = [p.name for p in tmp_path.glob("*.c") if p.name != "replay.c"]
    subprocess.run(["gcc", "-std=c99", "replay.c", source, "-lm", "-o", "replay"], cwd=tmp_path, check=True)
    done = subprocess.run(
        ["./replay", "reference_inputs.csv", "reference_outputs.csv"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 1


@pytest.mark.parametrize("suffix", ["", "_fmi3"])
def test_a_unit_goes_on_after_its_state_is_restored(folder: Path, suffix: str) -> None:
    import fmpy

    [path] = [p for p in folder.glob("*.fmu") if p.stem.endswith("_fmi3") == bool(suffix)]
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    assert any(n.startswith("sources/") and n.endswith(".c") for n in names)
    assert any(n.startswith("binaries/") and n.endswith(".so") for n in names)
    description = fmpy.read_model_description(str(path))
    inputs = [v for v in description.modelVariables if v.causality == "input"]
    outputs = [
        v.valueReference
        for v in description.modelVariables
        if v.causality == "output" and v.type in ("Real", "Float64")
    ]
    assert all(v.variability == "discrete" for v in inputs)
    unit = fmpy.instantiate_fmu(fmpy.extract(str(path)), description, "CoSimulation")
    three = suffix != ""
    if three:
        unit.enterInitializationMode(startTime=0.0)
    else:
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
    unit.exitInitializationMode()

    def read() -> list[float]:
        return list(unit.getFloat64(outputs) if three else unit.getReal(outputs))

    def steps(first: int, last: int) -> list[list[float]]:
        found = []
        for k in range(first, last):
            unit.doStep(10.0 * k, 10.0)
            found.append(read())
        return found

    steps(0, 50)
    if three:
        kept = unit.getFMUState()
        bytes_ = unit.serializeFMUState(kept)
        first = steps(50, 100)
        unit.setFMUState(unit.deserializeFMUState(bytes_))
    else:
        kept = unit.getFMUstate()
        bytes_ = unit.serializeFMUstate(kept)
        first = steps(50, 100)
        unit.setFMUstate(unit.deSerializeFMUstate(bytes_))
    assert steps(50, 100) == first
    unit.terminate()
    unit.freeInstance()


def test_structured_text_avoids_what_controllers_get_wrong(folder: Path) -> None:
    for path in (folder / "st").glob("*.st"):
        text = path.read_text()
        assert "FOR " not in text  # a compiler skips loops over one state
        assert text.isascii()
        body = text[text.index("FUNCTION_BLOCK") :]
        assert " / " not in body.replace("tau / DINT", "").replace("norm * ", "") or "_DIV" in text
        read_structured_text(text)


def test_names_cannot_break_out_of_code() -> None:
    assert "*/" not in comment("*/ int main() {} /*")
    assert "*)" not in comment("*) END_VAR (*")
    assert comment("a\nb\\") == "a b."
    assert identifiers(["Ä b", "a b", "A_B", "1x"]) == ["A_b", "a_b_2", "A_B_3", "m_1x"]


def test_a_model_that_runs_away_is_refused_and_nothing_is_written(campaign: Campaign, tmp_path: Path) -> None:
    states = {"a": State("a", "um", None, parse(0.0), 0.0, 1.0)}
    model = Model("wild", {}, states, (Term("t", "a", parse("0.01*a**2 + T_env")),), {"E_Z0T": parse("a")})
    with pytest.raises(UserError, match="diverges"):
        export_model(model, campaign, ["fit"], "st", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@needs_gcc
def test_reduction_states_its_error(campaign: Campaign, model: Model, tmp_path: Path) -> None:
    from discovery.export.document import read_document
    from discovery.export.reduce import reduce_model

    full = reduce_model(model, campaign, ["fit"], 2)
    assert len(full.model.states) == 2
    assert full.full_states == 3
    done = export_model(model, campaign, ["fit"], "c", tmp_path, states=2)
    back = read_document(done.files[0])
    assert len(back.compiled.states) == 2
    assert back.provenance["reduction"]["largest_error"] == pytest.approx(dict(full.largest_error))
    with pytest.raises(UserError, match="cannot be reduced to 3"):
        reduce_model(model, campaign, ["fit"], 3)


def test_a_linear_reduction_keeps_its_error_below_the_bound_of_the_theory() -> None:
    """A chain of bodies: the error of balanced truncation is at most twice the sum of the singular values
    left out.
    """
    from scipy.linalg import expm

    from discovery.export.compiled import compile_model
    from discovery.export.reduce import _directions, _projected
    from discovery.export.stepper import Stepper

    names = [f"b{k}" for k in range(6)]
    states = {n: State(n, "degC", None, parse(0.0), 0.0, 1.0) for n in names}
    terms = [Term("in", "b0", parse("0.01*u"))]
    terms += [
        Term("c", names[k + 1], parse(f"0.005*({names[k]} - {names[k + 1]})"), names[k]) for k in range(5)
    ]
    terms += [Term("air", n, parse(f"-0.001*{n}")) for n in names]
    model = Model("chain", {}, states, tuple(terms), {"y": parse("b5 + 0.5*b2")})
    compiled = compile_model(model, 10.0)
    u = np.random.default_rng(5).choice([-1.0, 1.0], size=(4000, 1))
    rest = {"x": (np.zeros(6), np.zeros((1, 1)))}
    mean, right, left, values = _directions(compiled, u, rest, 3)
    y = []
    for one in (compiled, compile_model(_projected(model, mean, right, left), 10.0)):
        stepper = Stepper(one)
        stepper.start(u[0])
        y.append(stepper.run(u)[:, 0])
    difference = np.sqrt(np.sum((y[0] - y[1]) ** 2))
    assert difference <= 2 * np.sum(values[3:]) * np.sqrt(np.sum((u / u.std()) ** 2)) * 1.02
    assert difference < 0.05 * np.sqrt(np.sum(y[0] ** 2))
    assert expm(np.zeros((1, 1))) == 1.0


@needs_gcc
def test_the_command_exports_a_run(model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import json

    from tests.export.conftest import make_campaign

    run = tmp_path / "run"
    write_model(run / "models" / "everything.toml", model)
    (run / "results.json").write_text(
        json.dumps(
            {
                "experiment": "small",
                "fit": ["fit"],
                "held_out": [],
                "models": {},
                "campaign_file": "campaign.toml",
            }
        )
    )
    monkeypatch.chdir(tmp_path)
    rows = make_campaign(2.0).recordings["fit"]
    table = np.column_stack([rows.time, *rows.values.values()])
    header = ",".join(["time", *rows.values])
    lines = [",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in table]
    (tmp_path / "fit.csv").write_text("\n".join([header, *lines]) + "\n")
    channels = "\n".join(
        f'{c.name} = {{ role = "{c.role}", unit = "{c.unit}" }}' for c in make_campaign(2.0).channels.values()
    )
    (tmp_path / "campaign.toml").write_text(
        f'name = "small"\n[channels]\n{channels}\n[recordings]\nfit = {{ file = "fit.csv" }}\n'
    )
    runner = CliRunner()
    done = runner.invoke(app, ["export", "run", "--model", "everything", "--to", "c", "--sign", "key.pem"])
    assert done.exit_code == 0, done.output
    assert "C double" in done.output
    assert (run / "export" / "everything" / "Everything_a_model.json").exists()
    everything = ["run", "--model", "everything", "--to"]
    for words, sentence, status in (
        (["run", "--model", "nobody", "--to", "c"], "no model 'nobody'", 1),
        (["elsewhere", "--model", "everything", "--to", "c"], "no results.json there", 1),
        ([*everything, "pickle"], "unknown export target 'pickle'", 2),
        ([*everything, "json", "--step", "0"], "a step of 0 s is not possible", 2),
        ([*everything, "json", "--step", "-5"], "a step of -5 s is not possible", 2),
        ([*everything, "json", "--step", "nan"], "a step of nan s is not possible", 2),
    ):
        done = runner.invoke(app, ["export", *words])
        assert done.exit_code == status
        assert sentence in done.output


def test_a_controller_needs_no_reading_to_start(campaign: Campaign, tmp_path: Path) -> None:
    """A state that begins at its first reading begins at 0 (an error) or at the room (a body)."""
    from dataclasses import replace

    from discovery.export.document import read_document
    from discovery.recordings import Channel

    channels = {**campaign.channels, "T_table": Channel("T_table", "temperature", "degC", None, "linear")}
    campaign = replace(campaign, channels=channels)
    states = {
        "E_Z0T": State("E_Z0T", "um", None, None, 0.0, 1.0),
        "slow": State("slow", "um", None, parse("E_A0C"), 0.0, 1.0),
        "T_table": State("T_table", "degC", None, None, 0.5, 1.0),
    }
    terms = (
        Term("t", "E_Z0T", parse("1e-4*(T_env - 22) - 1e-4*E_Z0T")),
        Term("b", "T_table", parse("1e-3*(T_env - T_table)")),
    )
    model = Model("starts", {}, states, terms, {"E_A0C": parse("slow + T_table")})
    done = export_model(model, campaign, ["fit"], "json", tmp_path)
    back = read_document(done.files[0])
    assert back.compiled.inputs == ("T_env",)
    assert [o.name for o in back.outputs] == ["E_A0C", "E_Z0T", "T_table"]
    from discovery.export.stepper import Stepper

    stepper = Stepper(back.compiled)
    stepper.start(np.array([23.5]))
    assert stepper.x.tolist() == [0.0, 0.0, 23.5]
    roomless = replace(campaign, channels={n: c for n, c in channels.items() if n != "T_env"})
    with pytest.raises(UserError, match="starts at the reading of T_table"):
        export_model(model, roomless, ["fit"], "json", tmp_path)


@needs_gcc
@pytest.mark.parametrize("name", ["replay", "Replay", "instance", "fmi2", "fmi3", "math"])
def test_a_model_may_have_the_name_of_a_file_beside_it(tmp_path: Path, name: str) -> None:
    """Every file that was proved stands there: the C files compile as they were written."""
    body = State("a", "degC", 1e4, parse("T_env"), 0.5, 1e-4)
    air = Term("air", "a", parse("2*(T_env - a) + 0.1*P_drive"))
    model = Model(name, {}, {"a": body}, (air,), {"E_Z0T": parse("2*(a - 22)")})
    done = export_model(model, make_campaign(1.0), ["fit"], ["c", "fmu", "fmu3"], tmp_path)
    assert {proof.target for proof in done.proofs} == {"C double", "C float", "FMI 2.0", "FMI 3.0"}
    sources = sorted(path.name for path in (tmp_path / "c").glob("*.c"))
    assert len(sources) == 2
    assert "int main(" in (tmp_path / "c" / "replay.c").read_text()
    subprocess.run(
        ["gcc", "-std=c99", "-I.", *sources, "-lm", "-o", tmp_path / "a.out"], cwd=tmp_path / "c", check=True
    )
    for path in tmp_path.glob("*.fmu"):
        with zipfile.ZipFile(path) as archive:
            names = [Path(n).name.lower() for n in archive.namelist()]
            assert len(names) == len(set(names))
            assert len([n for n in names if n.endswith(".c")]) == 2


def test_an_output_that_is_no_channel_is_not_compensated(
    campaign: Campaign, model: Model, tmp_path: Path
) -> None:
    from dataclasses import replace

    from discovery.export.document import read_document
    from discovery.runtime.compensator import Compensator

    more = replace(model, outputs={"T_guess": parse("a"), **model.outputs})
    done = export_model(more, campaign, ["fit"], "st", tmp_path)
    back = read_document(done.files[0])
    assert [(o.name, o.role, o.unit) for o in back.outputs] == [
        ("E_Z0T", "error", "um"),
        ("E_A0C", "error", "um/m"),
    ]
    assert Compensator(back).names == ["E_Z0T", "E_A0C"]
    assert set((done.agreement or {})["integrator"]) == {"um", "um/m"}
    assert max((done.agreement or {})["integrator"].values()) < 1e-3
    assert not any("nothing compensates" in line for line in done.lines())
    with pytest.raises(UserError, match="no output is a channel"):
        export_model(replace(model, outputs={"T_guess": parse("a")}), campaign, ["fit"], "json", tmp_path)


def test_temperatures_are_exported_in_kelvin_and_compensate_nothing(
    campaign: Campaign, tmp_path: Path
) -> None:
    from dataclasses import replace

    rows = {
        name: replace(campaign.channels[name], role="temperature", unit="degC") for name in ("E_Z0T", "E_A0C")
    }
    states = {"y": State("y", "degC", 1e4, parse("T_env"), 0.0, 1e-4)}
    heat = (Term("heat", "y", parse("P_drive/10")), Term("air", "y", parse("2*(T_env - y)")))
    outputs = {"E_Z0T": parse("y"), "E_A0C": parse("y + 1")}
    bodies = Model("bodies", {}, states, heat, outputs)
    targets = ["c", "st"] if HAS_GCC else ["st"]
    warm = replace(campaign, channels={**campaign.channels, **rows})
    done = export_model(bodies, warm, ["fit"], targets, tmp_path)
    said = "nothing compensates an error, there are no offsets: the outputs are temperatures"
    lines = done.lines()
    assert lines[-1] == f"{said} (E_Z0T, E_A0C)"
    assert not any(" um " in line for line in lines)
    assert sum(" K from the Python model" in line for line in lines) == (4 if HAS_GCC else 2)
    [step] = [line for line in lines if line.startswith("the fixed step is")]
    assert step.count(" K ") == 2
    heads = [*tmp_path.glob("c/bodies.h"), *tmp_path.glob("st/FB_bodies_*.st")]
    assert len(heads) == (3 if HAS_GCC else 2)
    for head in heads:
        assert said in head.read_text()
        assert "[degC]" in head.read_text()
        assert "position of the axis" not in head.read_text()
