"""Units of both FMI versions: guards as in the runtime, parameters by name, and the order of calls."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from discovery.export.document import Exported
from discovery.export.fmu import fmu_bytes
from discovery.export.ranges import sampled_inputs
from discovery.export.stepper import Stepper
from discovery.recordings import Campaign
from tests.export.conftest import make_campaign, make_model, needs_gcc
from tests.export.guarded import by_the_runtime, faulty
from tests.export.test_guarded_c import sealed

fmpy = pytest.importorskip("fmpy")


class Unit:
    """One instance, whatever the version of the standard."""

    def __init__(self, path: Path) -> None:
        description = fmpy.read_model_description(str(path))
        self.three = description.fmiVersion.startswith("3")
        self.places = {v.name: v.valueReference for v in description.modelVariables}
        self.kinds = {v.name: v.type for v in description.modelVariables}
        self.unit = fmpy.instantiate_fmu(fmpy.extract(str(path)), description, "CoSimulation")

    def initialise(self) -> None:
        if self.three:
            self.unit.enterInitializationMode(startTime=0.0)
        else:
            self.unit.setupExperiment(startTime=0.0)
            self.unit.enterInitializationMode()

    def get(self, names: list[str]) -> list[float]:
        kind = self.kinds[names[0]]
        found = getattr(self.unit, f"get{kind}")([self.places[n] for n in names])
        return [float(value) for value in found]

    def set(self, values: dict[str, Any]) -> None:
        for kind in {self.kinds[n] for n in values}:
            some = {n: v for n, v in values.items() if self.kinds[n] == kind}
            getattr(self.unit, f"set{kind}")([self.places[n] for n in some], list(some.values()))


@pytest.fixture(scope="module")
def campaign_of_six_hours() -> Campaign:
    return make_campaign(hours=6.0)


@pytest.fixture(scope="module")
def exported(campaign_of_six_hours: Campaign) -> Exported:
    return sealed(make_model(), campaign_of_six_hours)


@pytest.fixture(scope="module", params=[2, 3])
def path(request: Any, exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fmu") / "model.fmu"
    path.write_bytes(fmu_bytes(exported, request.param))
    return Path(path)


@contextmanager
def running(path: Path) -> Iterator[Unit]:
    unit = Unit(path)
    unit.initialise()
    yield unit
    unit.unit.terminate()
    unit.unit.freeInstance()


@needs_gcc
def test_a_unit_guards_as_the_runtime_does(
    path: Path, exported: Exported, campaign_of_six_hours: Campaign
) -> None:
    inputs = sampled_inputs(campaign_of_six_hours, "fit", exported.compiled.inputs, 10.0)
    given = faulty(exported, inputs, 5, episodes=15)
    given.age[:] = 0.0
    offsets, status, gains = by_the_runtime(exported, given)
    names = exported.compiled.inputs
    wanted = [f"offset.{o.name}" for o in exported.outputs] + ["runtime.gain"]
    with running(path) as unit:
        unit.unit.exitInitializationMode()
        for k in range(len(inputs)):
            unit.set(dict(zip(names, given.value[k].tolist(), strict=True)))
            switches = {f"good.{n}": bool(v) for n, v in zip(names, given.good[k], strict=True)}
            words = ("enable", "part_done", "acknowledge")
            unit.set(
                switches | {f"runtime.{w}": bool(v) for w, v in zip(words, given.switches[k], strict=True)}
            )
            unit.unit.doStep(10.0 * k, 10.0)
            found = unit.get(wanted)
            assert found == pytest.approx([*offsets[k], gains[k]], abs=1e-9), k
            assert unit.get(["runtime.status"]) == [status[k]]


@needs_gcc
def test_outputs_are_there_in_initialisation(path: Path, exported: Exported) -> None:
    """They had been 0 until the first step."""
    values = [25.0 if spec.unit == "degC" else spec.range.high for spec in exported.inputs]
    stepper = Stepper(exported.compiled)
    stepper.start(np.array(values))
    with running(path) as unit:
        unit.set(dict(zip(exported.compiled.inputs, values, strict=True)))
        found = unit.get([o.name for o in exported.outputs])
        assert found == pytest.approx(stepper.outputs(np.array(values)).tolist())
        assert any(found)
        unit.unit.exitInitializationMode()


@needs_gcc
def test_calls_out_of_order_are_refused(path: Path) -> None:
    unit = Unit(path)
    with pytest.raises(Exception, match="failed with status 3"):
        unit.unit.doStep(0.0, 10.0)
    unit.initialise()
    with pytest.raises(Exception, match="failed with status 3"):
        unit.unit.doStep(0.0, 10.0)
    unit.unit.exitInitializationMode()
    unit.unit.doStep(0.0, 10.0)
    with pytest.raises(Exception, match="failed with status 3"):
        unit.set({"runtime.gain": 2.0})
    with pytest.raises(Exception, match="failed with status 3"):
        unit.set({"G": float("nan")})
    unit.unit.terminate()
    with pytest.raises(Exception, match="failed with status 3"):
        unit.unit.doStep(10.0, 10.0)
    unit.unit.freeInstance()


@needs_gcc
def test_a_parameter_can_be_tuned_by_its_name(path: Path, exported: Exported) -> None:
    with running(path) as unit:
        assert unit.get(["G"]) == [24.0]
        unit.set({"G": 30.0})
        unit.unit.exitInitializationMode()
        unit.unit.doStep(0.0, 600.0)
        assert unit.get(["G"]) == [30.0]
        tuned = unit.get([o.name for o in exported.outputs])
    with running(path) as unit:
        unit.unit.exitInitializationMode()
        unit.unit.doStep(0.0, 600.0)
        assert unit.get([o.name for o in exported.outputs]) != pytest.approx(tuned, abs=1e-6)
