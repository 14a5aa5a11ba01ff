"""`python -m benchmarks.networks` writes sound cases, and the same bytes each time."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from benchmarks.networks import write
from discovery.cli import app


def test_a_network_is_sound_and_has_the_same_bytes_twice(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    key = write(one, 9, 0.02, 0.02, 300, "conduction_path")
    assert key["effect"] == "conduction_path"
    assert key == write(other, 9, 0.02, 0.02, 300, "conduction_path")
    assert {p.name: p.read_bytes() for p in one.iterdir()} == {
        p.name: p.read_bytes() for p in other.iterdir()
    }
    answer = CliRunner().invoke(app, ["check", str(one)])
    assert answer.exit_code == 0, answer.output
