"""The live view in headless Chromium."""

from __future__ import annotations

from pathlib import Path

from tests.browser.driver import browser


def test_the_page_in_a_browser(address: str, tmp_path: Path) -> None:
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
