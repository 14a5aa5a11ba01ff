"""Time of one step: C in double and float, the Python reference, a tick of the compensator; full and reduced
model.

python benchmarks/step.py
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path

from discovery.export.c import c_files, c_prefix
from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.reduce import reduce_model
from discovery.export.replay import make_reference, reference_files, replay_source, write_files
from discovery.export.seal import open_seal
from discovery.export.stepper import Stepper
from discovery.fitting import fit_model
from discovery.models.modelfile import read_model
from discovery.recordings import load_campaign
from discovery.runtime.injection import try_faults

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"


def c_step(exported: Exported, u: object, flags: list[str]) -> str:
    """What the shipped replay program says of a million steps."""
    with tempfile.TemporaryDirectory() as name:
        files = {**c_files(exported), **replay_source(exported)}
        write_files(
            Path(name), {**files, **reference_files(exported.compiled, make_reference(exported.compiled, u))}
        )
        source = ["replay.c", f"{c_prefix(exported)}.c"]
        subprocess.run(
            ["gcc", "-std=c99", "-O2", *flags, *source, "-lm", "-o", "replay"], cwd=name, check=True
        )
        command = ["./replay", "reference_inputs.csv", "reference_outputs.csv", "1000000"]
        return subprocess.run(command, cwd=name, capture_output=True, text=True, check=True).stdout.replace(
            "\n", "; "
        )


def main() -> None:
    """Print all times."""
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    model = fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model
    for title, one in (
        ("six states", model),
        ("three states", reduce_model(model, campaign, ["fit"], 3).model),
    ):
        exported = from_document(*open_seal(render(make_document(one, campaign, ["fit"])), "model"), "model")
        u = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)
        for kind, flags in (("double", []), ("float", ["-DDISCOVERY_FLOAT"])):
            print(f"{title}, C {kind}: {c_step(exported, u, flags)}")
        stepper = Stepper(exported.compiled)
        stepper.start(u[0])
        stepper.run(u[:10])
        began = time.perf_counter()
        stepper.run(u)
        print(
            f"{title}, Python reference, many steps: {1e6 * (time.perf_counter() - began) / len(u):.2f} "
            "us per step"
        )
        try_faults(exported, u[:10], [], 10.0)
        began = time.perf_counter()
        try_faults(exported, u[:5000], [], 10.0)
        print(f"{title}, tick of the compensator: {1e6 * (time.perf_counter() - began) / 5000:.0f} us")


if __name__ == "__main__":
    main()
