"""What docs/operations.md promises: a unit that systemd takes, and words to its watchdog."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from discovery.runtime.notify import notify

PAGE = (Path(__file__).parents[2] / "docs" / "operations.md").read_text()


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not installed")
def test_the_unit_is_taken_by_systemd(tmp_path: Path) -> None:
    unit = re.findall(r"```ini\n(.*?)```", PAGE, re.DOTALL)[0]
    unit = re.sub(r"ExecStart=.*?memory --out offsets.csv", "ExecStart=/bin/true", unit, flags=re.DOTALL)
    path = tmp_path / "compensation@.service"
    path.write_text(unit.replace("User=compensation", "User=root"))
    done = subprocess.run(
        ["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False
    )
    assert not [line for line in done.stderr.splitlines() if "compensation@" in line]


def test_the_options_of_the_unit_are_those_of_the_command() -> None:
    from typer.testing import CliRunner

    from discovery.cli import app

    words = CliRunner().invoke(app, ["compensate", "--help"], env={"COLUMNS": "200"}).output
    used = set(re.findall(r"--[a-z-]+", re.findall(r"```ini\n(.*?)```", PAGE, re.DOTALL)[0]))
    assert used
    assert all(option in words for option in used)


def test_the_service_manager_hears(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    notify(READY=1)  # nobody listens: nothing happens
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
        one.bind(str(tmp_path / "notify"))
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        notify(WATCHDOG=1, STATUS="ACTIVE, 7 ticks")
        assert one.recv(100) == b"WATCHDOG=1\nSTATUS=ACTIVE, 7 ticks"
    notify(WATCHDOG=1)  # nobody listens any more
