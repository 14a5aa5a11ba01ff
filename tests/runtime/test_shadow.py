"""Another model: shadow run, bumpless change, one step back, refusal."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.export.document import Exported, render
from discovery.export.seal import open_seal, private_key, public_key
from discovery.runtime.command import go_back, trusted_model
from discovery.runtime.compensator import Compensator, Settings, State
from discovery.runtime.guards import Reading
from discovery.runtime.session import Session
from discovery.runtime.shadow import Rule, begin_shadow
from discovery.runtime.store import ACTIVE, PREVIOUS, REFUSED
from tests.runtime.small import small


def changed(document: bytes, factor: float) -> bytes:
    """The model with another loss, as an update would write it."""
    body, _ = open_seal(document, "test")
    body = json.loads(json.dumps(body))
    for parameter in body["parameters"]:
        if parameter["name"] in ("loss_c1", "loss_c2"):
            parameter["value"] *= factor
    return render(body | {"revision": 2})


def work(
    session: Session,
    minutes: np.ndarray,
    first: int,
    measured: np.ndarray | None = None,
    compensated: bool = False,
) -> np.ndarray:
    """Offsets of ticks every minute; `measured` errors come every 10 min, if `compensated` less what the last
    offsets took off in steps of 1 um, with that beside them.
    """
    names, out = session.compensator.exported.compiled.inputs, []
    for k in range(first, first + 400):
        now = k * 60.0
        readings = {n: Reading(v, now) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        found = {}
        if measured is not None and k % 10 == 0:
            names_of_errors, applied = session.compensator.names, np.zeros(len(session.compensator.names))
            if compensated:
                applied = np.round(-np.array(session.compensator.offsets))
                readings |= {
                    f"{n}_applied": Reading(v, now)
                    for n, v in zip(names_of_errors, applied.tolist(), strict=True)
                }
            found = {
                n: Reading(v, now)
                for n, v in zip(names_of_errors, (measured[k] - applied).tolist(), strict=True)
            }
        out.append(list(session.tick(readings | found, now).offsets.values()))
    session.close(now)
    return np.array(out)


def verdict(said: list[str]) -> str:
    """What was said of the new model."""
    [found] = [text for text in said if "the new model" in text]
    return found


@pytest.fixture
def files(document: bytes, tmp_path: Path) -> dict[str, Path]:
    paths = {"old": tmp_path / "old.json", "near": tmp_path / "near.json", "far": tmp_path / "far.json"}
    paths["old"].write_bytes(document)
    paths["near"].write_bytes(changed(document, 1.05))
    paths["far"].write_bytes(changed(document, 4.0))
    return paths


def begin(path: Path, folder: Path, said: list[str], rule: Rule) -> Session:
    exported, _ = trusted_model(path, None, allow_unsigned=True)
    return Session(
        exported, model=path, folder=folder, settings=Settings(tick_s=60.0), rule=rule, say=said.append
    )


def test_a_new_model_takes_over_without_a_step_and_can_be_taken_back(
    files: dict[str, Path], minutes: np.ndarray, tmp_path: Path
) -> None:
    memory, said, rule = tmp_path / "memory", list[str](), Rule(hours=3.0, most_um=20.0)
    first = work(begin(files["old"], memory, said, rule), minutes, 0)
    session = begin(files["near"], memory, said, rule)
    assert session.shadow is not None
    second = work(session, minutes, 400)
    assert "takes over" in verdict(said)
    assert session.compensator.exported.revision == 2
    assert (memory / ACTIVE).read_bytes() == files["near"].read_bytes()
    rates = np.array(session.compensator.rate) * 60.0
    steps = np.abs(np.diff(np.concatenate([first, second]), axis=0))
    assert np.all(steps <= rates + 1e-9)
    go_back(memory, said.append)
    assert (memory / ACTIVE).read_bytes() == files["old"].read_bytes()
    assert (memory / PREVIOUS).read_bytes() == files["near"].read_bytes()
    third = work(begin(files["old"], memory, said, rule), minutes, 800)
    assert np.all(np.abs(third[0] - second[-1]) <= rates + 1e-9)


def test_a_model_that_is_far_off_is_refused(
    files: dict[str, Path], minutes: np.ndarray, tmp_path: Path
) -> None:
    memory, said, rule = tmp_path / "memory", list[str](), Rule(hours=3.0, most_um=5.0)
    work(begin(files["old"], memory, said, rule), minutes, 0)
    session = begin(files["far"], memory, said, rule)
    work(session, minutes, 400)
    assert "is refused" in verdict(said)
    assert session.compensator.exported.revision == 1
    assert (memory / REFUSED).read_bytes() == files["far"].read_bytes()


def test_without_measured_errors_no_model_takes_over(
    files: dict[str, Path], minutes: np.ndarray, tmp_path: Path
) -> None:
    memory, said, rule = tmp_path / "memory", list[str](), Rule(hours=3.0)
    work(begin(files["old"], memory, said, rule), minutes, 0)
    work(begin(files["near"], memory, said, rule), minutes, 400)
    assert "is refused" in verdict(said)
    assert "only 0 measured errors came, 5 are needed" in verdict(said)


@pytest.mark.parametrize("compensated", [False, True])
@pytest.mark.parametrize(("truth", "passes"), [("near", True), ("old", False)])
def test_measured_errors_decide_where_there_are_enough(
    files: dict[str, Path], minutes: np.ndarray, tmp_path: Path, truth: str, passes: bool, compensated: bool
) -> None:
    from discovery.export.document import read_document
    from discovery.export.stepper import Stepper

    stepper = Stepper(read_document(files[truth]).compiled)
    stepper.start(minutes[0])
    measured = stepper.run(np.repeat(minutes, 6, axis=0))[::6]
    memory, said, rule = tmp_path / "memory", list[str](), Rule(hours=3.0, most_um=0.0)
    work(begin(files["old"], memory, said, rule), minutes, 0)
    work(begin(files["near"], memory, said, rule), minutes, 400, measured, compensated)
    assert ("takes over" in verdict(said)) is passes


@pytest.mark.parametrize(
    ("reading", "counted"),
    [
        (Reading(999.0, 0.0, False), 0),  # a dead sensor, shown every tick
        (Reading(999.0, 24_600.0, False), 0),
        (Reading(3.0, 0.0), 0),  # from before the shadow run
        (Reading(3.0, 1e9), 0),  # from the future
        (Reading(math.nan, 24_600.0), 0),
        (Reading(3.0, 24_600.0), 1),  # good, and still shown long afterwards
    ],
)
def test_a_reading_counts_once_and_only_if_it_is_good(
    files: dict[str, Path], minutes: np.ndarray, tmp_path: Path, reading: Reading, counted: int
) -> None:
    """One reading on ten ticks from 24 600 s on, in a shadow run that begins at 24 000 s."""
    memory, said, rule = tmp_path / "memory", list[str](), Rule(hours=1000.0)
    work(begin(files["old"], memory, said, rule), minutes, 0)
    session = begin(files["near"], memory, said, rule)
    names = session.compensator.exported.compiled.inputs
    for k in range(400, 420):
        readings = {n: Reading(v, k * 60.0) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        session.tick(readings | ({"E_Y0C": reading} if k >= 410 else {}), k * 60.0)
    session.close(420 * 60.0)
    assert session.shadow is not None
    assert {n: len(pairs) for n, pairs in session.shadow.residuals.items()} == (
        {"E_Y0C": counted} if counted else {}
    )


def test_what_nobody_signed_is_not_run(document: bytes, tmp_path: Path) -> None:
    key = private_key(tmp_path / "key.pem")
    private_key(tmp_path / "other.pem")
    body, _ = open_seal(document, "test")
    signed, unsigned = tmp_path / "signed.json", tmp_path / "unsigned.json"
    signed.write_bytes(render(body, key))
    unsigned.write_bytes(document)
    trusted_model(signed, tmp_path / "key.pem.pub", allow_unsigned=False)
    assert public_key(tmp_path / "key.pem.pub").public_bytes_raw() == key.public_key().public_bytes_raw()
    with pytest.raises(UserError, match="not signed"):
        trusted_model(unsigned, tmp_path / "key.pem.pub", allow_unsigned=False)
    with pytest.raises(UserError, match="not the trusted one"):
        trusted_model(signed, tmp_path / "other.pem.pub", allow_unsigned=False)
    with pytest.raises(UserError, match="no key is trusted"):
        trusted_model(signed, None, allow_unsigned=False)


def test_an_input_that_is_lost_for_both_refuses_no_model(exported: Exported, minutes: np.ndarray) -> None:
    active = Compensator(exported, Settings(tick_s=60.0))
    shadow = begin_shadow(exported, Settings(tick_s=60.0))
    names = exported.compiled.inputs
    for k in range(480):
        readings = {n: Reading(v, 60.0 * k) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        if k >= 120:
            del readings["T_fluid"]
        active.tick(readings, 60.0 * k)
        shadow.tick(active, readings, 60.0 * k)
    assert active.state is shadow.compensator.state is State.FAULT
    assert not shadow.trouble


def test_a_constant_error_counts() -> None:
    """A worn machine differs from its model by nearly a constant, for the hours of a shadow run."""
    shadow = begin_shadow(small(), Settings(), Rule(hours=1.0))
    shadow.began, shadow.residuals = 0.0, {"E": [(1.0, 0.1)] * 10}
    found = shadow.verdict(3600.0)
    assert found is not None
    assert found[0]
    shadow.residuals = {"E": [(0.1, 1.0)] * 10}
    found = shadow.verdict(3600.0)
    assert found is not None
    assert not found[0]
