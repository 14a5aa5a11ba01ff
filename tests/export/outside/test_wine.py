"""The C code, compiled for Windows, gives the reference under wine."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from discovery.export.c import c_files, c_prefix
from discovery.export.fmu import WINDOWS
from discovery.export.ranges import sampled_inputs
from discovery.export.replay import CFLAGS, make_reference, reference_files, replay_source
from tests.export.conftest import make_campaign, make_model
from tests.export.outside.conftest import WINE
from tests.export.test_guarded_c import sealed


def test_the_c_code_is_the_model_on_windows(tmp_path: Path) -> None:
    campaign = make_campaign(hours=6.0)
    exported = sealed(make_model(), campaign)
    inputs = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)
    reference = make_reference(exported.compiled, inputs)
    files = {**c_files(exported), **replay_source(exported), **reference_files(exported.compiled, reference)}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    source = ["replay.c", f"{c_prefix(exported)}.c"]
    subprocess.run(
        [WINDOWS, *CFLAGS, *source, "-static", "-lm", "-o", "replay.exe"], cwd=tmp_path, check=True
    )
    done = subprocess.run(
        [str(WINE), "replay.exe", "reference_inputs.csv", "reference_outputs.csv"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env=os.environ | {"WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split()[-1]) < 1e-9
