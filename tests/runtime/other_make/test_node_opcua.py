"""The compensator as a user commissions it, against node-opcua: certificates by command, user and password,
node browser, a frozen server, a stop.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from discovery.export.document import Exported
from discovery.files import write_toml
from tests.runtime.other_make.conftest import FOLDER


class Machine:
    """The server process, and the folder of the connection to it."""

    def __init__(self, process: subprocess.Popen[str], folder: Path, url: str, space: int) -> None:
        self.process, self.folder, self.url, self.space = process, folder, url, space

    def ask(self, **wish: object) -> dict[str, Any]:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(wish) + "\n")
        self.process.stdin.flush()
        if "show" not in wish:
            return {}
        line = ""
        while not line.startswith("{"):  # node-opcua prints warnings of its own there
            line = self.process.stdout.readline()
            assert line, "the server has stopped"
        return dict(json.loads(line))

    def wait(self, **wanted: int) -> dict[str, Any]:
        """Until the low byte of the status, or the heartbeat, is as wanted (20 s at most)."""
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            seen = self.ask(show=True)
            state, beat = seen["status"] & 0xFF, seen["heartbeat"]
            if state == wanted.get("state", state) and beat >= wanted.get("beat", 0):
                return seen
            time.sleep(0.2)
        raise AssertionError(f"{seen} is not {wanted}")


def discovery(*words: object, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "discovery.cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, **options)


@pytest.fixture(scope="module")
def server(exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    folder = tmp_path_factory.mktemp("line3")
    made = discovery("opcua", "certificate", folder)
    assert made.returncode == 0, made.stderr
    values = {i.name: 0.5 * (i.range.low + i.range.high) for i in exported.inputs}
    names = [o.name for o in exported.outputs if o.role == "error"]
    log = (folder / "server.log").open("w")
    process = subprocess.Popen(
        ["node", str(Path(__file__).parent / "server.mjs"), str(folder), str(folder / "compensator.der")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        env=os.environ
        | {"NODE_OPCUA": str(FOLDER), "INPUTS": json.dumps(values), "OFFSETS": json.dumps(names)},
    )
    assert process.stdout is not None
    line = ""
    while not line.startswith("{"):
        line = process.stdout.readline()
        assert line, (folder / "server.log").read_text()
    said = json.loads(line)
    fetched = discovery("opcua", "certificate", folder, "--fetch", said["url"])
    assert fetched.returncode == 0, fetched.stderr
    (folder / "password").write_text("correct horse\n")
    space = said["namespace"]
    connection = {
        "url": said["url"],
        "certificate": "compensator.der",
        "private_key": "compensator.pem",
        "server_certificate": "server.der",
        "user": "compensator",
        "password_file": "password",
        "tick_s": 0.2,
        "status": f"ns={space};s=status",
        "heartbeat": f"ns={space};s=heartbeat",
        "message": f"ns={space};s=message",
        "acknowledge": f"ns={space};s=acknowledge",
        "enable": f"ns={space};s=enable",
        "inputs": {name: f"ns={space};s={name}" for name in values},
        "offsets": {name: f"ns={space};s=offset {name}" for name in names},
    }
    write_toml(folder / "connection.toml", connection)
    yield Machine(process, folder, said["url"], space)
    process.kill()
    process.wait()
    log.close()


def changed(server: Machine, name: str, **keys: object) -> Path:
    found = tomllib.loads((server.folder / "connection.toml").read_text()) | keys
    write_toml(server.folder / name, {key: value for key, value in found.items() if value is not None})
    return server.folder / name


def test_nodes_are_listed(server: Machine) -> None:
    done = discovery("opcua", "browse", server.folder / "connection.toml")
    assert done.returncode == 0, done.stderr
    [line] = [line for line in done.stdout.splitlines() if line.endswith("/Machine/T_env")]
    assert line.startswith(f"ns={server.space};s=T_env")
    assert "Double" in line
    assert any("read, write" in line and "/Machine/status" in line for line in done.stdout.splitlines())


def test_it_compensates_survives_a_frozen_server_and_stops_off(
    server: Machine, model_file: Path, tmp_path: Path
) -> None:
    command = [sys.executable, "-m", "discovery.cli", "compensate", str(model_file), "--allow-unsigned"]
    options = ["--opcua", str(server.folder / "connection.toml"), "--state", str(tmp_path / "memory")]
    process = subprocess.Popen(
        [*command, *options, "--out", str(tmp_path / "o.csv")], stderr=subprocess.PIPE, text=True
    )
    seen = server.wait(state=1, beat=10)
    assert any(seen["offsets"])
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 0, said
    after = server.wait(state=0)
    assert after["offsets"] == pytest.approx(seen["offsets"], abs=2.0)
    assert "correct horse" not in said
    rows = (tmp_path / "o.csv").read_text().splitlines()
    assert rows[-1].split(",")[1] == "OFF"
    assert len(rows) >= 11


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"user": "somebody"}, "user 'somebody' or its password is refused"),
        ({"user": None, "password_file": None}, "does not take this kind of login"),
        ({"application_uri": "urn:mine"}, "application_uri 'urn:mine' is not the one in"),
        ({"server_certificate": "compensator.der"}, "the certificate of the server (SHA-1 "),
        ({"certificate": "stranger.der", "private_key": "stranger.pem"}, "does not trust the certificate"),
    ],
)
def test_what_is_wrong_is_said(
    server: Machine, model_file: Path, keys: dict[str, object], sentence: str
) -> None:
    if "certificate" in keys and not (server.folder / "stranger.der").exists():
        assert discovery("opcua", "certificate", server.folder, "--name", "stranger").returncode == 0
    connection = changed(server, "wrong.toml", **keys)
    done = discovery("compensate", model_file, "--allow-unsigned", "--opcua", connection, "--seconds", 5)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert "correct horse" not in done.stderr
    assert "Traceback" not in done.stderr
