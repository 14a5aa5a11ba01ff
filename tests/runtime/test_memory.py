"""Memory on disk: kill -9 at any instant, damaged copies, gaps, another model."""

from __future__ import annotations

import gzip
import itertools
import json
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from discovery.export.document import Exported
from discovery.runtime.compensator import Compensator, Settings, State
from discovery.runtime.guards import Reading
from discovery.runtime.persistence import NAMES, restore, save
from discovery.runtime.session import Session

STEP = 10.0


def run(compensator: Compensator, inputs: np.ndarray, first: float, tick_s: float = 60.0) -> None:
    names = compensator.exported.compiled.inputs
    for k, row in enumerate(inputs):
        now = first + k * tick_s
        compensator.tick({n: Reading(v, now) for n, v in zip(names, row.tolist(), strict=True)}, now)


@pytest.fixture
def running(exported: Exported, minutes: np.ndarray) -> Compensator:
    compensator = Compensator(exported, Settings(tick_s=60.0))
    run(compensator, minutes[:600], 0.0)
    return compensator


def test_a_saved_state_goes_on_bit_for_bit(
    running: Compensator, exported: Exported, minutes: np.ndarray, tmp_path: Path
) -> None:
    save(running, tmp_path).result()
    other = Compensator(exported, Settings(tick_s=60.0))
    assert restore(other, tmp_path) == running.last
    for one in (running, other):
        run(one, minutes[600:900], 600 * 60.0)
    assert other.offsets == running.offsets
    assert np.array_equal(other.stepper.x, running.stepper.x)


def test_a_damaged_copy_is_passed_over_for_the_one_before(
    running: Compensator, exported: Exported, minutes: np.ndarray, tmp_path: Path
) -> None:
    save(running, tmp_path).result()
    before = running.last
    run(running, minutes[600:610], 600 * 60.0)
    save(running, tmp_path).result()
    data = (tmp_path / NAMES[0]).read_text()
    for damage in ("", data[:-100], data.replace("ACTIVE", "FAULTY"), "null", "[]", '{"body": 3}'):
        (tmp_path / NAMES[0]).write_text(damage)
        other = Compensator(exported)
        assert restore(other, tmp_path) == before
    (tmp_path / NAMES[1]).write_bytes(b"\xff\xfe")
    assert restore(Compensator(exported), tmp_path) is None


def test_a_state_of_another_model_is_not_restored(
    running: Compensator, exported: Exported, tmp_path: Path
) -> None:
    save(running, tmp_path).result()
    data = json.loads((tmp_path / NAMES[0]).read_text())
    body = json.loads(data["body"]) | {"model": "0" * 64}
    import hashlib

    text = json.dumps(body)
    (tmp_path / NAMES[0]).write_text(
        json.dumps({"sha256": hashlib.sha256(text.encode()).hexdigest(), "body": text})
    )
    assert restore(Compensator(exported), tmp_path) is None


def test_through_a_gap_the_state_is_that_of_a_machine_at_rest(
    running: Compensator, exported: Exported, minutes: np.ndarray, tmp_path: Path
) -> None:
    """Four hours off: against a runtime that was fed the resting machine all the time."""
    save(running, tmp_path).result()
    woken = Compensator(exported, Settings(tick_s=60.0))
    restore(woken, tmp_path)
    names = list(exported.compiled.inputs)
    rest = np.tile(minutes[599], (240, 1))
    for name in ("pump", "speed", "P_drive"):
        rest[:, names.index(name)] = 0.0
    run(running, rest, 600 * 60.0)
    run(woken, rest[-1:], (600 + 239) * 60.0)
    assert woken.state is State.WARM
    assert np.max(np.abs(woken.stepper.x - running.stepper.x)) < 1e-2  # K
    run(woken, np.repeat(rest[-1:], 300, axis=0), 840 * 60.0)
    run(running, np.repeat(rest[-1:], 300, axis=0), 840 * 60.0)
    assert woken.offsets == pytest.approx(running.offsets, abs=0.05)


@pytest.mark.parametrize("threaded", [False, True])
def test_a_save_that_fails_is_told_once_and_nothing_stops(
    exported: Exported, minutes: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, threaded: bool
) -> None:
    """A disk that is full for a while: told once, and again when it is full again."""
    names, said = exported.compiled.inputs, list[str]()
    full = True

    def fsync(_: int) -> None:
        if full:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("discovery.runtime.persistence.os.fsync", fsync)
    with ThreadPoolExecutor(max_workers=1) as pool:
        settings = Settings(tick_s=60.0)
        session = Session(
            exported,
            folder=tmp_path / "memory",
            settings=settings,
            save_every_s=60.0,
            beside=pool if threaded else None,
            say=said.append,
        )
        told = []
        for k in range(9):
            full = k < 3 or k >= 6
            row = minutes[k].tolist()
            session.tick({n: Reading(v, k * 60.0) for n, v in zip(names, row, strict=True)}, k * 60.0)
            pool.submit(lambda: None).result()  # what was begun is done
            told.append(len(said))
        session.close(9 * 60.0)
    late = int(threaded)  # a thread's failure is heard at the next save
    assert told == [0] * late + [1] * 6 + [2] * (3 - late)
    assert len(said) == 2
    assert all("No space left" in text and str(tmp_path / "memory") in text for text in said)
    assert session.compensator.heartbeat == 9
    assert restore(Compensator(exported), tmp_path / "memory") == 5 * 60.0


@pytest.mark.parametrize("instants", [(0.1, 0.02, 0.15)])
def test_killed_at_any_instant_it_returns_to_the_same_offsets(
    model_file: Path, tmp_path: Path, instants: tuple[float, ...]
) -> None:
    """The command itself, killed with -9 again and again, against one that was left alone."""
    source = tmp_path / "two_days.csv"
    with gzip.open(Path(__file__).parents[2] / "datasets" / "nmv5000" / "validation.csv.gz", "rt") as rows:
        source.write_text("".join(itertools.islice(rows, 3200)))

    def command(folder: str) -> list[str]:
        return [
            *(sys.executable, "-m", "discovery.cli", "compensate", str(model_file), "--allow-unsigned"),
            *(
                "--inputs",
                str(source),
                "--out",
                str(tmp_path / f"{folder}.csv"),
                "--state",
                str(tmp_path / folder),
            ),
        ]

    subprocess.run(command("whole"), check=True)
    killed = 0
    for share in instants:
        process = subprocess.Popen(command("killed"))
        deadline = time.monotonic() + 20.0
        before = (tmp_path / "killed" / NAMES[0]).exists() and (
            tmp_path / "killed" / NAMES[0]
        ).stat().st_mtime_ns
        while time.monotonic() < deadline and process.poll() is None:
            now = tmp_path / "killed" / NAMES[0]
            if now.exists() and now.stat().st_mtime_ns != before:
                break
            time.sleep(0.01)
        time.sleep(share)
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
    assert killed >= 2
    subprocess.run(command("killed"), check=True)

    def offsets(name: str) -> dict[str, list[float]]:
        lines = (tmp_path / f"{name}.csv").read_text().splitlines()[1:]
        rows = [
            line.split(",") for line in lines if line.count(",") == 8
        ]  # a line cut by the kill is no line
        return {row[0]: [float(value) for value in row[4:8]] for row in rows}

    whole, again = offsets("whole"), offsets("killed")
    assert list(whole)[-1] == list(again)[-1]
    common = whole.keys() & again.keys()
    assert len(common) > 0.95 * len(whole)
    assert max(np.max(np.abs(np.subtract(whole[t], again[t]))) for t in common) < 0.1
