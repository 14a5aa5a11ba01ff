"""A folder of experiments: done once, failures told, and the same on a Dask cluster whose workers die."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.experiment.many import experiments_in, is_finished, run_many
from tests.small import write_small

COUNT = 4


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Experiments of one model each, in folders of their own."""
    for k in range(COUNT):
        place = tmp_path / "fleet" / f"machine_{k}"
        place.mkdir(parents=True)
        write_small(place)
        text = (place / "experiment.toml").read_text()
        begin = text.index("reduced ")
        (place / "experiment.toml").write_text(text[:begin] + 'one_body = { file = "model.toml" }\n')
    return tmp_path / "fleet"


def test_a_folder_is_done_once_and_goes_on_where_files_changed(folder: Path, tmp_path: Path) -> None:
    bad = folder / "machine_2" / "experiment.toml"
    whole = bad.read_text()
    bad.write_text(whole.replace('fit = ["a", "b"]', 'fit = ["nobody"]'))
    out = tmp_path / "out"
    first = CliRunner().invoke(app, ["run", str(folder), "--out", str(out), "--quiet"])
    assert first.exit_code == 1
    assert "1 of 4 experiments could not be done" in first.output
    assert "machine_2/experiment.toml: error:" in first.output
    assert "no recording 'nobody'" in first.output
    stamps = {path: path.stat().st_mtime_ns for path in out.rglob("results.json")}
    assert len(stamps) == COUNT - 1
    bad.write_text(whole)
    model = folder / "machine_0" / "model.toml"
    model.write_text(model.read_text().replace("start = 10.0", "start = 11.0"))
    second = CliRunner().invoke(app, ["run", str(folder), "--out", str(out), "--quiet"])
    assert second.exit_code == 0, second.output
    assert second.output.count("(finished before)") == 2
    again = {path: path.stat().st_mtime_ns for path in out.rglob("results.json")}
    changed = {path.parts[-3] for path, stamp in again.items() if stamps.get(path) != stamp}
    assert changed == {"machine_0", "machine_2"}


def test_what_is_no_folder_of_experiments_is_said(tmp_path: Path, folder: Path) -> None:
    with pytest.raises(UserError, match="no experiment in this folder"):
        experiments_in(tmp_path / "out")
    file = str(folder / "machine_0" / "experiment.toml")
    result = CliRunner().invoke(app, ["run", file, "--dask", "tcp://127.0.0.1:1"])
    assert result.exit_code == 2
    assert "runs the experiments of a folder" in result.output


def test_a_scheduler_that_is_not_there_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("discovery.experiment.many._PATIENCE_S", 0.5)
    with pytest.raises(UserError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1;"):
        run_many(folder, folder / "out", "tcp://127.0.0.1:1")


@pytest.fixture
def cluster() -> Iterator[Any]:
    """A real scheduler with two workers, each a process of its own."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster


def test_a_worker_that_dies_loses_nothing(folder: Path, tmp_path: Path, cluster: Any) -> None:
    """One of two workers is killed while it runs an experiment: all are done, as without a cluster."""
    alone = run_many(folder, tmp_path / "alone")
    killed: list[int] = []

    def kill(_: str) -> None:
        if not killed:
            worker = next(iter(cluster.workers.values()))
            killed.append(worker.pid)
            os.kill(worker.pid, signal.SIGKILL)

    done = run_many(folder, tmp_path / "out", cluster.scheduler_address, kill)
    assert killed
    assert [one.failure for one in done] == [""] * COUNT
    for one, other in zip(done, alone, strict=True):
        assert is_finished(Path(one.experiment), one.folder)
        files = [
            p.relative_to(other.folder) for p in other.folder.rglob("*") if p.suffix in (".csv", ".toml")
        ]
        assert files
        for name in files:
            assert (one.folder / name).read_bytes() == (other.folder / name).read_bytes()
        assert values(one.folder) == values(other.folder)
    shutil.rmtree(done[1].folder)
    began = time.perf_counter()
    again = run_many(folder, tmp_path / "out", cluster.scheduler_address)
    assert [one.skipped for one in again] == [True, False, True, True]
    assert time.perf_counter() - began < 300


def values(out: Path) -> Any:
    return json.loads((out / "results.json").read_text())["models"]["one_body"]["values"]
