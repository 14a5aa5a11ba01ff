"""Files of a concealed case: recordings, campaign, the baseline that somebody believes in, experiment."""

from __future__ import annotations

from collections.abc import Mapping

from discovery.files import format_toml
from discovery.models import model_document
from discovery.virtual.log import Columns, csv_gz, decimals
from discovery.virtual.world import FIT, RECORDINGS, World


def case_files(title: str, world: World, logs: Mapping[str, Columns], *, stated: bool) -> dict[str, bytes]:
    """All files of a case folder by name. stated: the campaign states the noise of a reading."""
    machine = world.machine
    digits, origins = decimals(machine.channels), world.origins or {}
    files = {f"{name}.csv.gz": csv_gz(columns, digits, origins.get(name)) for name, columns in logs.items()}
    channels = {
        c.name: {"role": c.role, "unit": c.unit}
        | ({"noise": float(f"{world.noise * c.sd:.2g}")} if stated and c.series is None else {})
        for c in machine.channels
    }
    recordings = {name: {"file": f"{name}.csv.gz"} for name in RECORDINGS}
    baseline = model_document(machine.baseline)
    for state in baseline["states"].values():
        state.pop("start_sd", None)
    texts = {
        "campaign.toml": {"name": title, "channels": channels, "recordings": recordings},
        "baseline.toml": baseline,
        "experiment.toml": {
            "name": title,
            "campaign": "campaign.toml",
            "outputs": list(machine.outputs),  # thermometers of bodies, too: by default it is errors only
            "fit": list(FIT),
            "held_out": [r for r in RECORDINGS if r not in FIT],
            "models": {"baseline": {"file": "baseline.toml"}},
            "mismatch": {"model": "baseline"},
        },
    }
    return files | {name: format_toml(text).encode() for name, text in texts.items()}
