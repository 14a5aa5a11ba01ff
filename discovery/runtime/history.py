"""What happened, in SQLite: offsets, inputs and measured errors minute by minute, and every event.

`discovery watch` reads it while the compensation writes (write-ahead log). A disk that fails costs history,
never a tick.
"""

from __future__ import annotations

import json
import math
import sqlite3
import time as clock
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from discovery.runtime.compensator import Compensator, Tick
from discovery.runtime.events import Event
from discovery.runtime.guards import Reading, number

FILE = "history.sqlite"
EVERY_S = 60.0  # between two ticks that are kept; a change of state is always kept
FLUSH_S = 10.0  # between two writes, on the clock of the ticks ...
LEAST_S = 1.0  # ... and of the computer: recorded days pass in seconds
KEEP_S = 400 * 24 * 3600.0  # history older than this is forgotten
MOST_WAITING = 100_000  # rows kept in memory while the disk does not take them

_TABLES = """
CREATE TABLE IF NOT EXISTS tick (
    time REAL PRIMARY KEY, state TEXT, status INTEGER, gain REAL, offsets TEXT, inputs TEXT, errors TEXT);
CREATE TABLE IF NOT EXISTS event (time REAL, what TEXT, cause TEXT, remedy TEXT);
CREATE INDEX IF NOT EXISTS event_time ON event (time);
CREATE TABLE IF NOT EXISTS fact (name TEXT PRIMARY KEY, value TEXT);
"""


class History:
    """Writes the history of a compensation into its state folder."""

    def __init__(self, folder: Path, facts: Mapping[str, Any]) -> None:
        self.path = folder / FILE
        self.facts = dict(facts)
        self.waiting: list[tuple[str, tuple[Any, ...]]] = []
        self.kept: tuple[float, str] = (-math.inf, "")  # last tick that was kept
        self.flushed = self.written = -math.inf  # on the clock of the ticks, and of the computer
        self.failed: Exception | None = None  # why the last write was none
        self.ticks = 0
        self.base: Any = None

    def tick(self, compensator: Compensator, tick: Tick, readings: Mapping[str, Reading], now: float) -> None:
        """Keep a tick, if it is time, and the events of it."""
        self.ticks += 1
        if now - self.kept[0] >= EVERY_S or tick.state.name != self.kept[1] or now < self.kept[0]:
            self.kept = (now, tick.state.name)
            inputs = {g.spec.name: g.held for g in compensator.guards}
            errors = {n: number(readings[n].value) for n in compensator.names if n in readings}
            row = (
                now,
                tick.state.name,
                tick.status,
                compensator.gain,
                _json(tick.offsets),
                _json(inputs),
                _json(errors),
            )
            self.waiting.append(("INSERT OR REPLACE INTO tick VALUES (?,?,?,?,?,?,?)", row))
        last = {"time": now, "state": tick.state.name, "status": tick.status, "heartbeat": tick.heartbeat}
        self.facts |= last | {"ticks": self.ticks}

    def event(self, event: Event) -> None:
        """Keep an event."""
        row = (event.time, event.what, event.cause, event.remedy)
        self.waiting.append(("INSERT INTO event VALUES (?,?,?,?)", row))

    def flush(self, now: float, *, force: bool = False) -> Exception | None:
        """Write what waits, if it is time; the error where the disk did not take it the last time."""
        recent = 0.0 <= now - self.flushed < FLUSH_S or clock.monotonic() - self.written < LEAST_S
        if force or not recent:
            self.flushed, self.failed = now, self._write(now)
        return self.failed

    def _write(self, now: float) -> Exception | None:
        """Write what waits; the error where the disk does not take it."""
        del self.waiting[:-MOST_WAITING]
        try:
            if self.base is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self.base = sqlite3.connect(self.path, timeout=1.0, check_same_thread=False)
                self.base.execute("PRAGMA journal_mode=WAL")
                self.base.execute("PRAGMA synchronous=NORMAL")
                self.base.executescript(_TABLES)
            with self.base:
                for statement, row in self.waiting:
                    self.base.execute(statement, row)
                self.base.executemany(
                    "INSERT OR REPLACE INTO fact VALUES (?,?)",
                    [(name, json.dumps(value)) for name, value in self.facts.items()],
                )
                self.base.execute("DELETE FROM tick WHERE time < ?", (now - KEEP_S,))
                self.base.execute("DELETE FROM event WHERE time < ?", (now - KEEP_S,))
            self.waiting.clear()
            self.written = clock.monotonic()
        except (sqlite3.Error, OSError) as error:
            if isinstance(error, sqlite3.DatabaseError) and "malformed" in str(error):
                self._set_aside()
            return error
        return None

    def _set_aside(self) -> None:
        """Put a damaged history aside and begin a new one."""
        self.base.close()
        self.base = None
        self.path.replace(self.path.with_suffix(".damaged"))

    def close(self, now: float) -> None:
        """Write a last time."""
        self.flush(now, force=True)
        if self.base is not None:
            self.base.close()


def _json(values: Mapping[str, float | None]) -> str:
    return json.dumps(
        {n: round(v, 6) if v is not None and math.isfinite(v) else None for n, v in values.items()}
    )


def read_history(folder: Path, since_s: float = 24 * 3600.0) -> dict[str, Any]:
    """The last `since_s` seconds of a history: `facts`, `ticks` and `events` by column.

    Raises:
        FileNotFoundError: there is none in this folder.
    """
    path = folder / FILE
    if not path.is_file():
        raise FileNotFoundError(path)
    base = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=2.0)
    try:
        facts = {name: json.loads(value) for name, value in base.execute("SELECT name, value FROM fact")}
        last = float(facts.get("time", 0.0))
        ticks = base.execute(
            "SELECT time, state, status, gain, offsets, inputs, errors FROM tick WHERE time >= ? "
            "ORDER BY time",
            (last - since_s,),
        ).fetchall()
        events = base.execute(
            "SELECT time, what, cause, remedy FROM event WHERE time >= ? ORDER BY time DESC",
            (last - since_s,),
        ).fetchall()
        counts = dict(base.execute("SELECT what, count(*) FROM event GROUP BY what").fetchall())
    finally:
        base.close()
    rows = [
        dict(zip(("time", "state", "status", "gain"), row[:4], strict=True))
        | {"offsets": json.loads(row[4]), "inputs": json.loads(row[5]), "errors": json.loads(row[6])}
        for row in ticks
    ]
    names = ("time", "what", "cause", "remedy")
    return {
        "facts": facts,
        "ticks": rows,
        "events": [dict(zip(names, row, strict=True)) for row in events],
        "counts": counts,
    }
