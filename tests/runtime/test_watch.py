"""The recorded history, the live view over it (in a browser where one is installed), and the metrics."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from discovery.errors import UserError
from discovery.runtime.history import History, read_history
from discovery.runtime.watch import server


def get(url: str) -> str:
    with urllib.request.urlopen(url, timeout=10) as answer:
        return str(answer.read().decode())


def test_a_day_of_history_is_there(recorded_folder: Path) -> None:
    found = read_history(recorded_folder)
    assert found["facts"]["ticks"] == 2160
    assert [row["time"] for row in found["ticks"]] == [60.0 * k for k in range(719, 2160)]
    whats = [event["what"] for event in found["events"]]
    assert whats == ["DEGRADED -> ACTIVE", "ACTIVE -> DEGRADED"]
    lost = found["events"][1]
    assert lost["time"] == 1500 * 60.0
    assert (lost["cause"], lost["remedy"]) == (
        "T_fluid has no reading",
        "check the sensor of T_fluid and its cable",
    )


def test_metrics_are_in_the_format_of_prometheus(address: str) -> None:
    """Each line is a comment, or a name with labels and a number; each metric has one TYPE before it."""
    text = get(f"{address}/metrics")
    kinds: dict[str, str] = {}
    for line in text.splitlines():
        if line.startswith("# TYPE "):
            name, kind = line.split()[2:]
            assert name not in kinds
            kinds[name] = kind
        elif not line.startswith("#"):
            name, _, rest = line.partition("{") if "{" in line else line.partition(" ")
            assert name in kinds
            float(rest.rpartition(" ")[2] or rest)
    assert 'discovery_state{state="ACTIVE"} 1' in text
    assert "discovery_ticks_total 2160" in text
    assert 'discovery_events_total{what="ACTIVE -> DEGRADED"} 1' in text
    assert 'discovery_offset{name="E_A0C",unit="um/m"}' in text


def test_the_page_has_its_data(address: str) -> None:
    data = json.loads(get(f"{address}/data.json"))
    assert set(data["curves"]["offsets"]) == {"E_Y0C", "E_Z0T", "E_R0T", "E_A0C"}
    assert [p[1] for p in data["curves"]["errors"]["E_Y0C"]][-1] == 2.1
    with pytest.raises(urllib.error.HTTPError, match="404"):
        get(f"{address}/../state.json")


def test_a_folder_without_history_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no history here"):
        server(tmp_path, 0, 24.0)


def test_recorded_days_are_written_in_few_pieces_and_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A day of events in a moment: once at the start, with a saved state, and at the end."""
    from discovery.runtime.events import Event

    computer = iter([0.5] * 2000)
    monkeypatch.setattr("discovery.runtime.history.clock.monotonic", lambda: next(computer))
    history = History(tmp_path, {})
    there = []
    for k in range(1440):
        history.event(Event(60.0 * k, "a", "b"))
        assert history.flush(60.0 * k, force=k == 700) is None
        if k in (0, 699, 700, 1439):
            there.append(len(read_history(tmp_path, 1e6)["events"]))
    history.close(86_400.0)
    assert there == [1, 1, 701, 701]
    assert len(read_history(tmp_path, 1e6)["events"]) == 1440


def test_a_disk_that_fails_costs_no_tick_and_no_event(tmp_path: Path) -> None:
    (tmp_path / "no").write_text("a file where a folder should be")
    history = History(tmp_path / "no" / "memory", {})
    from discovery.runtime.events import Event

    history.event(Event(1.0, "a", "b"))
    assert history.flush(1.0) is not None
    assert history.flush(2.0) is not None  # not tried again so soon, and not written either
    history.path = tmp_path / "history.sqlite"
    assert history.flush(20.0) is None
    history.close(30.0)
    assert len(read_history(tmp_path)["events"]) == 1
