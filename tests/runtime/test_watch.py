"""The recorded history, the live view over it (in a browser where one is installed), and the metrics."""

from __future__ import annotations

import json
import shutil
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.history import History, read_history
from discovery.runtime.session import Session
from discovery.runtime.watch import server


@pytest.fixture(scope="module")
def folder(
    exported: Exported, model_file: Path, minutes: np.ndarray, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A day and a half with a sensor lost for half an hour and measured errors every hour."""
    folder = tmp_path_factory.mktemp("memory")
    session = Session(exported, model=model_file, folder=folder, settings=Settings(tick_s=60.0))
    names = exported.compiled.inputs
    for k in range(2160):
        readings = {n: Reading(v, 60.0 * k) for n, v in zip(names, minutes[k].tolist(), strict=True)}
        if 1500 <= k < 1530:
            del readings["T_fluid"]
        if k % 60 == 0:
            readings["E_Y0C"] = Reading(float(k) / 1000.0, 60.0 * k)
        session.tick(readings, 60.0 * k)
    session.close(60.0 * 2159)
    return folder


@pytest.fixture
def address(folder: Path) -> Iterator[str]:
    found = server(folder, 0, 24.0)
    thread = threading.Thread(target=found.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{found.server_address[1]}"
    found.shutdown()
    thread.join()
    found.server_close()


def get(url: str) -> str:
    with urllib.request.urlopen(url, timeout=10) as answer:
        return str(answer.read().decode())


def test_a_day_of_history_is_there(folder: Path) -> None:
    found = read_history(folder)
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


def test_a_disk_that_fails_costs_no_tick_and_no_event(tmp_path: Path) -> None:
    (tmp_path / "no").write_text("a file where a folder should be")
    history = History(tmp_path / "no" / "memory", {})
    from discovery.runtime.events import Event

    history.event(Event(1.0, "a", "b"))
    assert history.flush(1.0) is not None
    history.path = tmp_path / "history.sqlite"
    assert history.flush(20.0) is None
    history.close(30.0)
    assert len(read_history(tmp_path)["events"]) == 1


@pytest.mark.skipif(shutil.which("chromedriver") is None, reason="no browser (chromium-driver) is installed")
def test_the_page_in_a_browser(address: str, tmp_path: Path) -> None:
    from tests.browser.driver import browser

    with browser() as session:
        for scheme in ("light", "dark"):
            session.size(1000, 800, scheme)
            session.send("POST", "/url", {"url": f"{address}/"})
            drawn = session.run_async(
                "const done = arguments[0]; const wait = n => document.querySelectorAll('figure svg "
                "polyline').length >= 11"
                " || n > 100 ? done(document.querySelectorAll('figure svg polyline').length) : "
                "setTimeout(() => wait(n + 1), 50);"
                "wait(0);"
            )
            assert drawn == 11  # four offsets, seven inputs
        assert session.run("return document.getElementById('state').textContent") == "ACTIVE"
        assert (
            session.run(
                "return document.querySelectorAll('figure[data-chart=\"offset for E_Y0C\"] circle').length"
            )
            > 20
        )
        rows = session.run(
            "return [...document.querySelectorAll('#events tr')].map(r => r.cells[1].textContent)"
        )
        assert rows == ["DEGRADED -> ACTIVE", "ACTIVE -> DEGRADED"]
        assert not session.run("return document.documentElement.scrollWidth > innerWidth")
        assert not session.run(
            "return [...document.querySelectorAll('svg *')].some(e => /NaN|Infinity/.test(e.outerHTML))"
        )
        wrong = [entry for entry in session.log("browser") if entry["level"] in ("SEVERE", "WARNING")]
        assert wrong == []
        session.screenshot(tmp_path / "watch.png")
