"""Memory on disk: kill -9 at any instant, damaged copies, gaps, another model."""

from __future__ import annotations

import gzip
import hashlib
import itertools
import json
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.runtime.compensator import Compensator, Settings, State
from discovery.runtime.guards import Reading
from discovery.runtime.output import Output
from discovery.runtime.persistence import NAMES, peek, restore, save
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
    found = restore(other, tmp_path)
    assert found is not None
    assert found.time == running.last
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
        found = restore(other, tmp_path)
        assert found is not None
        assert found.time == before
    (tmp_path / NAMES[1]).write_bytes(b"\xff\xfe")
    assert restore(Compensator(exported), tmp_path) is None


def test_a_state_of_another_model_is_not_restored(
    running: Compensator, exported: Exported, tmp_path: Path
) -> None:
    save(running, tmp_path).result()
    change_body(tmp_path / NAMES[0], {"model": "0" * 64})
    assert restore(Compensator(exported), tmp_path) is None


def test_a_time_of_four_hundred_digits_is_left_aside(
    running: Compensator, exported: Exported, tmp_path: Path
) -> None:
    """A whole number that no floating-point number holds (found by fuzzing)."""
    save(running, tmp_path).result()
    change_body(tmp_path / NAMES[0], {"time": 10**400})
    assert peek(Compensator(exported), tmp_path) is None
    assert restore(Compensator(exported), tmp_path) is None


def change_body(path: Path, changes: dict[str, Any]) -> None:
    """Change a saved state and renew its checksum."""
    text = json.dumps(json.loads(json.loads(path.read_text())["body"]) | changes)
    path.write_text(json.dumps({"sha256": hashlib.sha256(text.encode()).hexdigest(), "body": text}))


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
    rest[::2, [names.index(name) for name in ("T_cool", "T_env", "T_fluid")]] += (
        0.005  # no sensor stands still
    )
    run(running, rest, 600 * 60.0)
    run(woken, rest[-1:], (600 + 239) * 60.0)
    assert woken.state is State.WARM
    assert np.max(np.abs(woken.stepper.x - running.stepper.x)) < 0.02  # K
    run(woken, np.tile(rest[-2:], (150, 1)), 840 * 60.0)
    run(running, np.tile(rest[-2:], (150, 1)), 840 * 60.0)
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
            background=pool if threaded else None,
            say=said.append,
        )
        told = []
        for k in range(9):
            full = k < 3 or k >= 6
            row = minutes[k].tolist()
            session.tick({n: Reading(v, k * 60.0) for n, v in zip(names, row, strict=True)}, k * 60.0)
            pool.submit(lambda: None).result()  # what was begun is done
            told.append(sum("cannot be saved" in text for text in said))
        session.close(9 * 60.0)
    late = int(threaded)  # a thread's failure is heard at the next save
    assert told == [0] * late + [1] * 6 + [2] * (3 - late)
    failures = [text for text in said if "cannot be saved" in text]
    assert all("No space left" in text and str(tmp_path / "memory") in text for text in failures)
    assert sum("state saved again" in text for text in said) == 1
    assert session.compensator.heartbeat == 9
    found = restore(Compensator(exported), tmp_path / "memory")
    assert found is not None
    assert found.time == 5 * 60.0


@pytest.mark.parametrize("instants", [(0.1, 0.02, 0.15)])
def test_killed_at_any_instant_it_returns_to_the_same_offsets(
    model_file: Path, tmp_path: Path, instants: tuple[float, ...]
) -> None:
    """The command itself, killed with -9 again and again, against one that was left alone."""
    source = tmp_path / "a_day.csv"
    with gzip.open(Path(__file__).parents[2] / "datasets" / "nmv5000" / "validation.csv.gz", "rt") as rows:
        source.write_text("".join(itertools.islice(rows, 1600)))

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

    whole, again = ((tmp_path / f"{name}.csv").read_text().splitlines() for name in ("whole", "killed"))
    assert len(whole) > 7_500
    assert [row.split(",")[0] for row in again] == [
        row.split(",")[0] for row in whole
    ]  # none lost or doubled
    cells = [np.array([row.split(",")[4:8] for row in rows[1:]], dtype=float) for rows in (whole, again)]
    assert np.max(np.abs(cells[0] - cells[1])) < 0.1


def test_a_state_from_the_future_is_refused_for_an_older_copy(
    running: Compensator, exported: Exported, minutes: np.ndarray, tmp_path: Path
) -> None:
    save(running, tmp_path).result()
    before = running.last
    assert before is not None
    run(running, minutes[600:610], before + 86_400.0)  # the clock was a day ahead
    save(running, tmp_path).result()
    found = restore(Compensator(exported), tmp_path, before + 600.0)
    assert found is not None
    assert found.time == before
    assert restore(Compensator(exported), tmp_path, before - 600.0) is None


def test_one_writer_a_folder(exported: Exported, model_file: Path, tmp_path: Path) -> None:
    first = Session(exported, model=model_file, folder=tmp_path)
    with pytest.raises(UserError, match=r"another compensation already uses this folder \(process \d+\)"):
        Session(exported, model=model_file, folder=tmp_path)
    first.close(0.0)
    Session(exported, model=model_file, folder=tmp_path).close(0.0)


@pytest.fixture
def day(tmp_path: Path) -> Path:
    """600 rows of ten hours."""
    source = tmp_path / "day.csv"
    with gzip.open(Path(__file__).parents[2] / "datasets" / "nmv5000" / "validation.csv.gz", "rt") as rows:
        source.write_text("".join(itertools.islice(rows, 601)))
    return source


def compensated(model_file: Path, source: Path | str, out: Path, folder: Path) -> list[str]:
    base = [sys.executable, "-m", "discovery.cli", "compensate", str(model_file), "--allow-unsigned"]
    return [*base, "--inputs", str(source), "--out", str(out), "--state", str(folder)]


def test_a_stop_is_safe_and_goes_on(model_file: Path, day: Path, tmp_path: Path) -> None:
    """SIGTERM while rows come by a pipe: state OFF is the last line, exit status 0, and the next run goes
    on.
    """
    lines, out, folder = day.read_text().splitlines(keepends=True), tmp_path / "o.csv", tmp_path / "memory"
    command = compensated(model_file, "-", out, folder)
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdin is not None
    process.stdin.writelines(lines[:300])
    process.stdin.flush()
    deadline = time.monotonic() + 240.0
    while time.monotonic() < deadline and not (out.exists() and out.stat().st_size > 100_000):
        time.sleep(0.05)
    process.send_signal(signal.SIGUSR1)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 0, said
    assert "switched off and its state is saved" in said
    assert out.read_text().splitlines()[-1].split(",")[1] == "OFF"
    done = subprocess.run(
        command, input=lines[0] + "".join(lines[300:]), text=True, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "continues from the state of" in done.stderr
    assert "events; ended" in done.stderr
    times = [float(row.split(",")[0]) for row in out.read_text().splitlines()[1:]]
    assert times == sorted(times)
    assert times[-1] == float(lines[-1].split(",")[0]) + STEP


def test_a_full_disk_is_survived_and_no_line_lost(
    exported: Exported, minutes: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is written for three ticks; told once, written later."""
    said, names, full = list[str](), exported.compiled.inputs, False
    session = Session(exported, folder=tmp_path / "memory", settings=Settings(tick_s=60.0), say=said.append)
    session.opens = lambda: Output(tmp_path / "o.csv", "h\n")

    class Disk:
        def __init__(self, file: Any) -> None:
            self.file = file

        def write(self, data: bytes) -> int:
            if full:
                raise OSError(28, "No space left on device")
            return int(self.file.write(data[:40]))  # a few bytes at a time

        def __getattr__(self, name: str) -> Any:
            return getattr(self.file, name)

    for k in range(9):
        full = 3 <= k < 6
        row = {n: Reading(v, k * 60.0) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        session.tick(row, k * 60.0)
        if k == 0:
            assert session.output is not None
            monkeypatch.setattr(session.output, "file", Disk(session.output.file))
    session.close(480.0)
    session.judge()
    beats = [row.split(",")[3] for row in (tmp_path / "o.csv").read_text().splitlines()[1:]]
    assert beats == [str(k + 1) for k in range(9)]
    assert sum("offsets cannot be written" in text for text in said) == 1
    assert sum("output written again" in text for text in said) == 1


def test_a_log_that_is_rotated_is_gone_on_with(tmp_path: Path) -> None:
    output = Output(tmp_path / "o.csv", "h\n")
    output.write("1\n")
    (tmp_path / "o.csv").rename(tmp_path / "o.csv.1")
    output.write("2\n")
    output.close()
    assert (tmp_path / "o.csv.1").read_text() == "h\n1\n"
    assert (tmp_path / "o.csv").read_text() == "h\n2\n"
    again = Output(tmp_path / "o.csv", "h\n", 2)  # the state knew of the header alone
    again.write("3\n")
    again.close()
    assert (tmp_path / "o.csv").read_text() == "h\n3\n"
