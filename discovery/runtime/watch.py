"""`discovery watch`: one local page on a running compensation, its data, and metrics for Prometheus.

It reads the recorded history and never talks to the compensation itself: it may be started, stopped or broken
without any effect on the machine.
"""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.runtime.compensator import State
from discovery.runtime.history import read_history

PAGE = Path(__file__).parent / "watch.html"
MOST_POINTS = 1500  # of a curve; more are thinned out


def server(folder: Path, port: int, hours: float) -> ThreadingHTTPServer:
    """A server of the page on this computer alone (`serve_forever` runs it).

    Raises:
        UserError: no history in the folder, or a port that is taken.
    """
    try:
        read_history(folder, 60.0)
    except FileNotFoundError:
        raise UserError(
            f"{folder}: no history here; name the folder that `discovery compensate --state` was given"
        ) from None

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            try:
                kind, body = _answer(self.path, folder, hours)
            except (OSError, sqlite3.Error, ValueError) as error:
                self.send_error(503, f"the history cannot be read: {error}")
                return
            if not kind:
                self.send_error(404)
                return
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
            pass

    try:
        return ThreadingHTTPServer(("127.0.0.1", port), Handler)
    except OSError as error:
        raise UserError(
            f"port {port} cannot be opened ({error.strerror}); give another one with --port"
        ) from None


def serve(folder: Path, port: int, hours: float, say: Callable[[str], None]) -> None:
    """Serve the page until it is interrupted."""
    with server(folder, port, hours) as found:
        say(f"http://127.0.0.1:{found.server_address[1]}/ shows {folder}; /metrics is for Prometheus")
        found.serve_forever()


def _answer(path: str, folder: Path, hours: float) -> tuple[str, bytes]:
    if path == "/":
        return "text/html; charset=utf-8", PAGE.read_bytes()
    if path == "/data.json":
        return "application/json", json.dumps(page_data(read_history(folder, hours * 3600.0))).encode()
    if path == "/metrics":
        return "text/plain; version=0.0.4", metrics(read_history(folder, 3600.0)).encode()
    return "", b""


def page_data(found: dict[str, Any]) -> dict[str, Any]:
    """What the page draws: facts, events, and curves by name (time, value), thinned out."""
    ticks = found["ticks"]
    step = max(1, len(ticks) // MOST_POINTS)
    shown = ticks[::step] + (ticks[-1:] if ticks and (len(ticks) - 1) % step else [])
    curves: dict[str, dict[str, list[list[float]]]] = {"offsets": {}, "inputs": {}, "errors": {}}
    for kind, of_kind in curves.items():
        for row in ticks if kind == "errors" else shown:
            for name, value in row[kind].items():
                if value is not None:
                    of_kind.setdefault(name, []).append([row["time"], value])
    states = [
        [row["time"], row["state"]]
        for k, row in enumerate(ticks)
        if k == 0 or row["state"] != ticks[k - 1]["state"]
    ]
    return {
        "facts": found["facts"],
        "curves": curves,
        "states": states,
        "events": found["events"][:500],
        "now": time.time(),
    }


def metrics(found: dict[str, Any]) -> str:
    """The state of a compensation in the text format of Prometheus, version 0.0.4."""
    facts, last = found["facts"], found["ticks"][-1] if found["ticks"] else None
    lines = [
        "# HELP discovery_last_tick_seconds Time of the last tick.",
        "# TYPE discovery_last_tick_seconds gauge",
        f"discovery_last_tick_seconds {facts.get('time', 0.0):.3f}",
        "# HELP discovery_ticks_total Ticks since the start.",
        "# TYPE discovery_ticks_total counter",
        f"discovery_ticks_total {facts.get('ticks', 0)}",
        "# HELP discovery_state 1 for the state of the compensation, 0 for all others.",
        "# TYPE discovery_state gauge",
        *(f'discovery_state{{state="{s.name}"}} {int(facts.get("state") == s.name)}' for s in State),
        "# HELP discovery_status Status word.",
        "# TYPE discovery_status gauge",
        f"discovery_status {facts.get('status', 0)}",
        "# HELP discovery_revision Revision of the active model.",
        "# TYPE discovery_revision gauge",
        f"discovery_revision {facts.get('revision', 0)}",
        "# HELP discovery_events_total Events by what happened.",
        "# TYPE discovery_events_total counter",
        *(f'discovery_events_total{{what="{_label(w)}"}} {n}' for w, n in sorted(found["counts"].items())),
    ]
    for kind, text in (("offsets", "Offset"), ("inputs", "Input of the model"), ("errors", "Measured error")):
        one = kind.removesuffix("s")
        lines += [f"# HELP discovery_{one} {text}, in its unit.", f"# TYPE discovery_{one} gauge"]
        units = facts.get("units", {})
        for name, value in (last[kind] if last else {}).items():
            if value is not None:
                unit = _label(units.get(name, ""))
                lines.append(f'discovery_{one}{{name="{_label(name)}",unit="{unit}"}} {value!r}')
    return "\n".join(lines) + "\n"


def _label(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
