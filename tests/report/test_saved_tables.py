"""Tables that are saved as LaTeX, by a button of the page or from Python: they compile as they are."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from html import unescape
from pathlib import Path

import pandas as pd
import pytest

import discovery
from discovery.report import page as report_page
from discovery.report.text import latex

CELLS = ["a_1 & b", "5 %", "µm/m", "−1.2·10⁻⁵", "W/m²", "x → y", "T\\{2}", "–", "σ ± 1 ~ ^ # $"]


def test_a_frame_is_a_tabular_with_intervals_and_no_nan() -> None:
    frame = pd.DataFrame(
        {"value": [1.23456, 22.0], "low": [1.1, math.nan], "high": [1.3, None], "unit": ["W/K", "um/m"]},
        index=["G_gap", "50 % & more"],
    )
    assert discovery.latex_table(frame).splitlines() == [
        r"\begin{tabular}{lrll}",
        r"\hline",
        r" & value & 95 \% interval & unit \\",
        r"\hline",
        r"G\_gap & 1.23 & 1.1 to 1.3 & W/K \\",
        r"50 \% \& more & 22 & -- & \textmu{}m/m \\",
        r"\hline",
        r"\end{tabular}",
    ]


def test_an_index_that_only_counts_is_left_out() -> None:
    frame = pd.DataFrame({"effect": ["flooded_gap"], "probability": [0.98], "fixed": [True]})
    assert "flooded\\_gap & 0.98 & yes" in discovery.latex_table(frame).splitlines()[4]


@pytest.mark.skipif(not shutil.which("node"), reason="needs node")
def test_the_page_writes_the_same_latex_as_python() -> None:
    script = (Path(report_page.__file__).parent / "charts.js").read_text("utf-8")
    begin = script.index("const forms = {")
    forms = script[begin : script.index("\n  };\n", begin) + 5]
    rows = json.dumps([CELLS, CELLS])
    said = subprocess.run(
        ["node", "-e", f"{forms}; process.stdout.write(forms.LaTeX({rows}))"],
        capture_output=True,
        check=True,
        encoding="utf-8",
    ).stdout
    assert said.splitlines()[2] == " & ".join(map(latex, CELLS)) + r" \\"


def test_the_terms_of_a_model_are_saved_as_plain_text(page: str) -> None:
    """Their cells hold formulas in MathML and lists, which have no plain text of their own."""
    table = unescape(page[page.index("<caption>Terms of thermobalance,") :].partition("</table>")[0])
    assert 'data-text="G_tc*(c_body_1 - table)"' in table
    assert 'data-text="G_tc = 24.3 W/K (22.1 to 26.5)"' in table
