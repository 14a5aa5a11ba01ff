"""A headless Chromium, driven by WebDriver over plain HTTP: nothing to install but the browser."""

from __future__ import annotations

import base64
import json
import socket
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
]


@dataclass(frozen=True)
class Browser:
    """One session."""

    address: str

    def send(self, method: str, path: str, body: Any = None) -> Any:
        """A WebDriver command; its value."""
        data = None if method == "GET" else json.dumps(body or {}).encode()
        request = urllib.request.Request(
            f"{self.address}{path}", data, {"Content-Type": "application/json"}, method=method
        )
        with urllib.request.urlopen(request, timeout=120) as answer:
            return json.load(answer)["value"]

    def open(self, page: Path) -> None:
        """Load a file."""
        self.send("POST", "/url", {"url": page.resolve().as_uri()})

    def run(self, script: str, *arguments: Any) -> Any:
        """The value that a script returns."""
        return self.send("POST", "/execute/sync", {"script": script, "args": arguments})

    def run_async(self, script: str) -> Any:
        """The value that a script hands to its last argument."""
        return self.send("POST", "/execute/async", {"script": script, "args": []})

    def press(self, *keys: str) -> None:
        """Press keys where the focus is."""
        actions = [
            step
            for key in keys
            for step in ({"type": "keyDown", "value": key}, {"type": "keyUp", "value": key})
        ]
        self.send("POST", "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Drag with the mouse, in pixels of the window."""
        steps = [
            {"type": "pointerMove", "duration": 0, "x": start[0], "y": start[1]},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "duration": 80, "x": end[0], "y": end[1]},
            {"type": "pointerUp", "button": 0},
        ]
        self.send(
            "POST",
            "/actions",
            {
                "actions": [
                    {
                        "type": "pointer",
                        "id": "mouse",
                        "parameters": {"pointerType": "mouse"},
                        "actions": steps,
                    }
                ]
            },
        )

    def size(self, width: int, height: int, scheme: str = "light") -> None:
        """Size of the window and colour scheme."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.devtools("Emulation.setDeviceMetricsOverride", metrics)
        self.devtools(
            "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        )

    def devtools(self, command: str, parameters: dict[str, Any]) -> Any:
        """A command of the DevTools protocol."""
        return self.send("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def screenshot(self, path: Path, whole: bool = True) -> None:
        """A picture of the page, or of what the window shows."""
        shot = self.devtools(
            "Page.captureScreenshot",
            {"format": "png", "captureBeyondViewport": whole, **({"clip": self._clip()} if whole else {})},
        )
        path.write_bytes(base64.b64decode(shot["data"]))

    def _clip(self) -> dict[str, float]:
        width, height = self.run(
            "return [document.documentElement.clientWidth, document.documentElement.scrollHeight]"
        )
        return {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}

    def pdf(self, path: Path) -> None:
        """The page as it prints."""
        path.write_bytes(base64.b64decode(self.send("POST", "/print", {})))

    def log(self, kind: str) -> list[dict[str, Any]]:
        """Entries of a log since the last call."""
        entries: list[dict[str, Any]] = self.send("POST", "/se/log", {"type": kind})
        return entries


@contextmanager
def browser() -> Iterator[Browser]:
    """A session with a fresh profile, ended with everything it has started."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with tempfile.TemporaryDirectory() as profile:
        server = subprocess.Popen(["chromedriver", f"--port={port}", "--log-level=OFF"])
        try:
            session = Browser(f"http://127.0.0.1:{port}")
            _wait(session)
            options = {"args": [*FLAGS, f"--user-data-dir={profile}"]}
            wanted = {
                "browserName": "chrome",
                "goog:chromeOptions": options,
                "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
            }
            made = session.send("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
            session = Browser(f"{session.address}/session/{made['sessionId']}")
            session.send("POST", "/timeouts", {"script": 110_000})
            try:
                yield session
            finally:
                session.send("DELETE", "")
        finally:
            server.terminate()
            server.wait(20)


def _wait(session: Browser) -> None:
    for _ in range(100):
        try:
            session.send("GET", "/status")
        except OSError:
            time.sleep(0.1)
        else:
            return
    raise RuntimeError("chromedriver does not answer")
