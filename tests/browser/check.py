"""What a reader meets: reports opened in a real browser. ``make browser-test``

    python -m tests.browser.check AXE REPORT... [--pictures FOLDER]

AXE is axe.min.js of the package axe-core. Needs Chromium and its driver (Debian: chromium, chromium-driver).
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import time as clock
from pathlib import Path

from tests.browser.driver import Browser, browser

CUT = (  # elements that show only a part of their content, or stick out of the page
    "return [...document.querySelectorAll('.scroll, .equation, .formula, pre, td, th, svg.network')]"
    ".filter(e => e.offsetParent && e.getBoundingClientRect().width"
    " && (getComputedStyle(e).overflowX === 'visible'"
    " ? e.getBoundingClientRect().right > innerWidth + 1 : e.scrollWidth > e.clientWidth + 1))"
    ".map(e => `${e.getAttribute('aria-label') || e.textContent.slice(0, 40)}"
    " (${e.scrollWidth} > ${e.clientWidth} px)`)"
)
WIDTHS = (1440, 1024, 800, 390)


def check(page: Path, axe: str, session: Browser, pictures: Path | None) -> list[str]:
    """Sentences on everything that is wrong with a page."""
    wrong = [f"{page.stat().st_size} bytes are more than 3 MB"] if page.stat().st_size > 3_000_000 else []
    session.send("POST", "/url", {"url": "about:blank"})
    session.log("browser")
    session.log("performance")
    for width in WIDTHS:
        for scheme in ("light", "dark"):
            session.size(width, 900, scheme)
            session.open(page)
            where = f"{width} px, {scheme}"
            wrong += [f"{where}: {line}" for line in _figures(session) + _rules(session, axe)]
            wrong += [f"{where}: cut: {one}" for one in session.run(CUT)]
            if session.run("return document.documentElement.scrollWidth > innerWidth"):
                wrong.append(f"{where}: wider than the window")
            if pictures:
                session.screenshot(pictures / f"{page.parent.name}-{page.stem}-{width}-{scheme}.png")
    wrong += _keyboard(session) + _zoom(session) + _saved(session)
    if pictures:
        session.pdf(pictures / f"{page.parent.name}-{page.stem}.pdf")
    wrong += [
        f"console: {entry['message']}"
        for entry in session.log("browser")
        if entry["level"] in ("SEVERE", "WARNING")
    ]
    return wrong + _requests(session, page)


DRAWN_S = 20.0  # a slow computer may take so long for all charts of a page
_EMPTY = (
    "const drawn = 'svg polyline, svg path, svg rect.bars';"
    "return [...document.querySelectorAll('figure[data-chart]')]"
    ".filter(f => f.offsetParent && !f.querySelector(drawn))"
    ".map(f => f.dataset.chart)"
)


def _figures(session: Browser) -> list[str]:
    until = clock.monotonic() + DRAWN_S  # charts are drawn when the browser has time for them
    while (empty := session.run(_EMPTY)) and clock.monotonic() < until:
        clock.sleep(0.2)
    bad = session.run(
        "return [...document.querySelectorAll('svg *')].filter(e => /NaN|Infinity/.test(e.outerHTML)).length"
    )
    return [f"figure {key} is empty" for key in empty] + (
        [f"{bad} drawn elements without a place"] if bad else []
    )


def _rules(session: Browser, axe: str) -> list[str]:
    session.run(axe)
    found = session.run_async(
        "const done = arguments[0];"
        "axe.run().then(r => done(r.violations), e => done([{id: String(e), nodes: []}]))"
    )
    return [f"{one['id']}: {one.get('help', '')} ({len(one['nodes'])} times, {_first(one)})" for one in found]


def _first(violation: dict[str, list[dict[str, object]]]) -> str:
    nodes = violation["nodes"]
    return f"{nodes[0]['target']} {str(nodes[0].get('failureSummary', ''))[:160]}" if nodes else ""


def _keyboard(session: Browser) -> list[str]:
    """Every control is reached with the tabulator, and a chart answers to keys."""
    wanted = session.run(
        "return [...document.querySelectorAll('a[href], button, summary, .plot, input:checked')]"
        ".filter(e => e.offsetParent && !e.hidden).length"
    )
    if not wanted:
        return []
    session.run(
        "document.activeElement.blur(); window.reached = new Set();"
        "document.addEventListener('focusin', e => reached.add(e.target))"
    )
    session.press(*["\ue004"] * (wanted + 60))
    reached = session.run("return reached.size")
    wrong = [f"keyboard: {reached} of at least {wanted} controls reached"] if reached < wanted else []
    if session.run("const p = document.querySelector('.plot'); if (p) p.focus(); return Boolean(p)"):
        session.press("\ue014", "\ue014", "+")
        said, zoomed = session.run(
            "const f = document.activeElement.closest('figure');"
            "return [f.querySelector('.readout').textContent, !f.querySelector('.reset').hidden]"
        )
        wrong += [] if said and zoomed else ["keyboard: a chart neither reads values nor zooms"]
        session.press("0")
    return wrong


def _zoom(session: Browser) -> list[str]:
    box = session.run(
        "const p = document.querySelector('.plot'); if (!p) return null;"
        "p.scrollIntoView({block: 'center', behavior: 'instant'});"
        "const b = p.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]"
    )
    if not box:
        return []
    x, y, width, height = box
    session.drag((int(x + 0.4 * width), int(y + height / 3)), (int(x + 0.7 * width), int(y + height / 3)))
    return (
        []
        if session.run(
            "return !document.querySelector('.plot').closest('figure').querySelector('.reset').hidden"
        )
        else ["dragging over a chart does not zoom"]
    )


def _saved(session: Browser) -> list[str]:
    """Each table is saved row by row; a second line within a cell is set apart."""
    found = session.run_async(
        "const done = arguments[0], kept = [], make = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => (kept.push(blob), 'data:,');"
        "HTMLAnchorElement.prototype.click = () => {};"
        "const all = [...document.querySelectorAll('.tools button')];"
        "const buttons = all.filter(b => b.textContent === 'CSV');"
        "buttons.forEach(b => b.dispatchEvent(new MouseEvent('click')));"
        "URL.createObjectURL = make; delete HTMLAnchorElement.prototype.click;"
        "Promise.all(kept.map(b => b.text())).then(texts => done(buttons.map((b, k) => {"
        " const table = b.closest('table');"
        " return [table.caption.firstChild.textContent, texts[k] || '', table.rows.length,"
        "  table.querySelectorAll('th .tag').length]})))"
    )
    bare = session.run(
        "return [...document.querySelectorAll('.scroll > table')].filter(t => t.tHead)"
        ".filter(t => t.querySelectorAll('caption .tools button').length < 2).map(t => t.caption.textContent)"
    )
    wrong = [f"no buttons to save it: {title}" for title in bare]
    for title, text, rows, seconds in found:
        lines = list(csv.reader(io.StringIO(text)))
        if len(lines) != rows or sum(" · " in line[0] for line in lines) < seconds:
            wrong.append(f"saved as CSV: {title}: {text[:80]!r}")
    return wrong


def _requests(session: Browser, page: Path) -> list[str]:
    urls = set()
    for entry in session.log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            urls.add(message["params"]["request"]["url"].split("#")[0])
    return [
        f"request: {url[:120]}"
        for url in sorted(urls)
        if not url.startswith("data:") and url != page.resolve().as_uri()
    ]


def main() -> None:
    """Check the reports that are named; end with status 1 when one is wrong."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("axe", type=Path)
    arguments.add_argument("reports", type=Path, nargs="+")
    arguments.add_argument("--pictures", type=Path)
    given = arguments.parse_args()
    axe = given.axe.read_text("utf-8")
    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
    failed = False
    with browser() as session:
        for page in given.reports:
            wrong = check(page, axe, session, given.pictures)
            failed |= bool(wrong)
            print(f"{page}: {'; '.join(['', *wrong]) if wrong else 'sound'}".replace("; ", "\n  "))
    raise SystemExit(1 if failed else 0)


if __name__ == "__main__":
    main()
