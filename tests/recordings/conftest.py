"""A campaign of one recording, written by the test that looks at it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from discovery.recordings.check import check_campaign

CAMPAIGN = """name = "test"

[channels]
T_env = { role = "ambient temperature", unit = "degC" }
speed = { role = "rotation speed", unit = "rpm" }
E_Y0C = { role = "error", unit = "um", noise = 0.5 }

[recordings]
fit = { file = "fit.csv" }
"""

Write = Callable[..., Path]


def rows(count: int = 60) -> list[str]:
    """The lines of a good recording: inputs every minute, a reading every other minute."""
    lines = ["time,T_env,speed,E_Y0C"]
    for i in range(count):
        reading = f"{0.1 * i + (i * 7 % 5) / 10:.2f}" if i % 2 == 0 else ""
        lines.append(f"{60 * i},{20 + i % 7 / 10:.1f},{600 if i < 30 else 0},{reading}")
    return lines


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes campaign.toml and its data file; gives the campaign's path."""

    def write(
        data: str | bytes | list[str] | None = None, campaign: str = CAMPAIGN, name: str = "fit.csv"
    ) -> Path:
        data = rows() if data is None else data
        text = "\n".join(data) + "\n" if isinstance(data, list) else data
        (tmp_path / name).write_bytes(text.encode() if isinstance(text, str) else text)
        path = tmp_path / "campaign.toml"
        path.write_text(campaign.replace("fit.csv", name), encoding="utf-8")
        return path

    return write


def found(path: Path) -> list[str]:
    """Findings without the folder, as they are printed."""
    return [str(finding).replace(f"{path.parent}/", "") for finding in check_campaign(path)]


def with_line(number: int, text: str) -> list[str]:
    lines = rows()
    lines[number - 1] = text
    return lines


def with_column(place: int, cells: list[str]) -> list[str]:
    """The good recording with the cells of one column replaced, from the second line on."""
    lines = [line.split(",") for line in rows(len(cells))]
    for line, cell in zip(lines[1:], cells, strict=True):
        line[place] = cell
    return [",".join(line) for line in lines]
