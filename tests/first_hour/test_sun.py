"""A house whose walls the sun warms: irradiance is a source of heat, with or without another one."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.firsthour.new import new

CLOCK = np.arange(0.0, 3 * 86400.0, 1800.0)
SUN = np.clip(900.0 * np.sin(2 * np.pi * CLOCK / 86400.0), 0.0, None)
OUTSIDE = 12.0 + 6.0 * np.sin(2 * np.pi * (CLOCK - 10000.0) / 86400.0)


def house(path: Path, header: str, heater: bool) -> Path:
    on = np.where((CLOCK // 21600) % 3 == 1, 1900.0, 0.0) * heater
    room = np.full(CLOCK.size, 20.0)
    for k in range(1, CLOCK.size):
        heat = on[k - 1] + 2.0 * SUN[k - 1] - 120.0 * (room[k - 1] - OUTSIDE[k - 1])
        room[k] = room[k - 1] + 1800.0 * heat / 9e6
    columns = [OUTSIDE, SUN, room, *([on] if heater else [])]
    rows = [f"{t:.0f}," + ",".join(f"{c[k]:.2f}" for c in columns) for k, t in enumerate(CLOCK)]
    names = f"time [s],T_outdoor,{header},T_wall" + (",Qh" if heater else "")
    path.write_text("\n".join([names, *rows]) + "\n")
    return path


@pytest.mark.parametrize("header", ["I_sol", "ghi", "roof [W/m2]"])
@pytest.mark.parametrize("heater", [True, False])
def test_the_sun_warms_what_it_falls_on(header: str, heater: bool, tmp_path: Path) -> None:
    said = new(tmp_path / "house", [house(tmp_path / "house.csv", header, heater)], quick=True)
    assert not [line for line in said if "no column says what heats" in line]
    warmed = re.findall(r'name = "(\w+) warms T_wall"', (tmp_path / "house" / "model.toml").read_text())
    assert warmed == [*(["Qh"] if heater else []), header.partition(" ")[0]]


def test_a_file_without_anything_to_predict_says_how_to_name_it(tmp_path: Path) -> None:
    rows = [f"{60 * k},{k % 2},{200 + 30 * np.sin(k / 20):.3f},{k % 2}" for k in range(100)]
    file = tmp_path / "odd.csv"
    file.write_text("\n".join(["time [s],mode,qqq,shadowed", *rows]) + "\n")
    with pytest.raises(UserError, match=r'--is "qqq=temperature,degC".*columns are mode, qqq, shadowed'):
        new(tmp_path / "odd", [file], quick=True)
