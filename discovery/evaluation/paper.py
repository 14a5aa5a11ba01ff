"""What the paper measured (Tables 1 and 3 of "Compensation of cutting fluid influences on five axis machine
tools"), and which recordings play its parts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discovery.recordings import Campaign

SOURCE = (
    "Compensation of cutting fluid influences on five axis machine tools, Mori Seiki NMV 5000 DCG, IWF Zurich"
)

# Table 1: reduction of the arithmetic mean [%] by the thermobalance: test cycle, second test cycle, nozzle on
# the left.
TABLE_1_COLUMNS = ("test cycle", "2. test cycle", "left side")
TABLE_1: dict[str, tuple[float, float, float]] = {
    "E_Y0C": (85.5, 86.7, 92.7),
    "E_R0T": (68.8, 62.5, 77.3),
    "E_Z0T": (65.6, 66.4, 83.1),
    "E_A0C": (60.1, 64.0, 32.4),
}

# Table 3: (P_V, M_V, Q_M) by error and row; "8" and "9" are the models of equations (8) and (9).
TABLE_3: dict[str, dict[str, tuple[float, float, float]]] = {
    "E_Y0C": {
        "uncompensated": (49, -35, 73),
        "8": (25, -0.2, 15),
        "9": (16, 6, 6),
        "8 %": (49, 99, 80),
        "9 %": (69, 82, 91),
    },
    "E_Z0T": {
        "uncompensated": (42, 28, 44),
        "8": (29, -0.3, 16),
        "9": (27, 1, 8),
        "8 %": (30, 99, 64),
        "9 %": (34, 97, 81),
    },
    "E_R0T": {
        "uncompensated": (15, 11, 1.7),
        "8": (5, -2, 0.5),
        "9": (7, -0.1, 0.5),
        "8 %": (65, 84, 71),
        "9 %": (56, 99, 73),
    },
    "E_A0C": {
        "uncompensated": (38, 16, 80),
        "8": (41, -4, 62),
        "9": (125, -12, 63),
        "8 %": (-9, 75, 23),
        "9 %": (-232, 27, 21),
    },
}
EQUATION = {"superposition": "8", "reduced": "9"}  # kind of model -> equation of the paper


def parts_of_the_paper(campaign: Campaign, fit: Sequence[str], held_out: Sequence[str]) -> dict[str, str]:
    """Which recording plays which part of the paper: "test cycle", "2. test cycle", "left side", "100 mm".

    The left nozzle is recognised by a channel of role nozzle side or by its name, the 100 mm by a nozzle
    height of 100.
    """
    left = [name for name in held_out if "left" in name.lower() or _constant(campaign, name, "nozzle side")]
    high = [
        name
        for name in held_out
        if name not in left and (_constant(campaign, name, "nozzle height") or 0.0) > 75.0
    ]
    plain = [name for name in held_out if name not in left and name not in high]
    parts = {"test cycle": fit, "2. test cycle": plain, "left side": left, "100 mm": high}
    return {part: names[0] for part, names in parts.items() if names}


def _constant(campaign: Campaign, recording: str, role: str) -> float | None:
    """Mean of the first channel of a role."""
    for channel in campaign.channels.values():
        values = campaign.recordings[recording].values.get(channel.name)
        if channel.role == role and values is not None and np.isfinite(values).any():
            return float(np.nanmean(values))
    return None
