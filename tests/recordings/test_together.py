"""An inverter that writes nothing at night: one line for all that is empty in the same rows."""

from __future__ import annotations

import numpy as np
from typer.testing import CliRunner

from discovery.cli import app
from tests.recordings.conftest import Write

CAMPAIGN = """name = "test"

[channels]
T_env = { role = "ambient temperature", unit = "degC" }
volts = { role = "other input", unit = "V" }
amps = { role = "other input", unit = "A" }
module = { role = "temperature", unit = "degC" }
frame = { role = "temperature", unit = "degC" }

[recordings]
fit = { file = "fit.csv" }
"""


def test_columns_that_are_empty_together_share_a_line(write: Write) -> None:
    rows = ["time,T_env,volts,amps,module,frame"]
    for k in range(240):
        day = f"{300 + 9 * np.sin(k):.1f},{5 + np.cos(k):.2f}" if k < 80 or k > 200 else ","
        air = 10 + 3 * np.sin(k / 30)
        rows.append(f"{60 * k},{air:.2f},{day},{air + 9 + np.sin(k / 9):.2f},{air + 4 + np.cos(k / 7):.2f}")
    told = CliRunner().invoke(app, ["check", str(write(rows, CAMPAIGN))]).stdout.splitlines()
    empty = [line for line in told if "is empty for" in line]
    assert len(empty) == 1
    assert "(the same of amps)" in empty[0]
    unknown = [line.partition("fit.csv, ")[2] for line in told if "not known at" in line]
    assert unknown == [
        "line 82: 'volts', 'amps' are not known at 121 of 240 readings of 'module'; "
        "record them as long as the readings, or leave these out (the same of frame)"
    ]
