"""A measuring machine in a room that warms by day: granite table, ceramic bridge, ram; all is dry.

Heat comes from the room: people and sun by day, an air conditioner that pulses. The air below the ceiling
is a state of its own, the granite conducts so badly that its top and its bottom are bodies of five cells
each.
"""

from __future__ import annotations

import numpy as np

from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import ALUMINIUM, CERAMIC, GRANITE, Bar
from discovery.virtual.network import Form, Inputs, Law, Switch, heat, link
from discovery.virtual.signals import Draw, lagged, levels, noise, room, shifts

PACE = Pace(
    hours=96.0, step_s=30.0, log_s=120.0, read_s=(420.0, 900.0), before_h=48.0, noise=(0.15, 0.8), heat_w=0.15
)
WORDS = Words(power="P_drives")


def measuring_machine(rng: Draw, refine: int = 1) -> Machine:
    """A bridge machine of some 1 m, the granite 0.2 m thick."""
    a = Assembly(rng, refine=refine)
    about = a.about
    thick, area = about(0.2, 0.1), about(1.1)
    a.body(Bar("granite_top", GRANITE, thick / 2, area, 5))
    a.body(Bar("granite_bottom", GRANITE, thick / 2, area, 5))
    leg, span = about(0.7, 0.1), about(0.9, 0.1)
    a.body(Bar("legs", CERAMIC, leg, about(0.016), 5))
    a.body(Bar("beam", CERAMIC, span, about(0.012), 6))
    a.body(Bar("ram", ALUMINIUM, about(0.8, 0.1), about(2.5e-3), 6))

    a.joint(
        "granite_top", "granite_bottom", GRANITE.conductivity * area / (thick / 8), (0.75, 1.0), (0.0, 0.25)
    )
    a.joint("legs", "granite_top", about(1.5), (0.0, 0.2), (0.0, 0.2))
    a.joint("beam", "legs", about(4.0), (0.0, 1.0), (0.8, 1.0))
    a.joint("ram", "beam", about(1.2), (0.3, 0.7), (0.3, 0.7))
    a.air("granite_top", about(5.5), exponent=0.1, at=(0.0, 0.2))
    a.air("granite_bottom", about(3.5), exponent=0.1, at=(0.8, 1.0))
    a.air("legs", about(4.0), exponent=0.1)
    a.air("beam", about(4.5), exponent=0.1)
    a.air("ram", about(2.5), exponent=0.1)
    a.loss("beam", "P_drives", about(0.2), at=(0.0, 0.3))
    a.loss("ram", "P_drives", about(0.25), at=(0.3, 1.0))

    # the air below the ceiling follows the room late; the beam and the legs see some of it
    shine = about(0.06)  # m2
    a.nature(
        link("ceiling", "ceiling", "T_env", 20.0),
        *[
            Law("shine", Form.RADIATION, node, "ceiling", shine * share)
            for node, share in a.span("granite_top", 0.0, 0.2)
        ],
        heat("warm air", "ceiling", 1.0, "P_people"),
        Law("conditioner", Form.HEAT, "ceiling", size=-60.0, switch="conditioner"),
        nodes={"ceiling": about(1.5e5)},
        switches={"conditioner": Switch("ceiling", 21.3, 0.3)},
    )

    a.lacks("radiation", ("granite_top",), "shine", believed=lambda _: None)

    tilt = 6.0 / (thick / 2)
    a.error("E_X", "um", {"beam": 7.4 * span * 0.6, "granite_top": -6.0 * span * 0.5}, uneven=0.1)
    a.error("E_Z", "um", {"legs": 7.4 * leg, "ram": -23.5 * 0.15, "granite_top": 0.3}, uneven=0.1)
    a.error("E_B", "um/m", {"granite_top": tilt * 0.4, "granite_bottom": -tilt * 0.4}, noise=2.0, uneven=0.1)
    a.sensor("T_beam", "beam", 0.07, at=(0.4, 0.6))

    channels = [
        felt("T_env", "ambient temperature", sd=0.02, decimals=3),
        logged("P_drives", "heat load", "W", 1),
        logged("P_lamps", "heat load", "W"),
        logged("fan_room", "other input", "percent"),
    ]
    return a.machine(
        "measuring machine",
        channels,
        _cycle,
        WORDS,
        PACE,
        heat=15.0,
        on_bed=("granite_bottom",),
        unlinked=(("ram", "legs"), ("beam", "granite_top")),
        spare=(
            Spare("fan_room", "input_exchange", "granite_top", "T_env", size=5.0, full=100.0),
            Spare("fan_room", "input_exchange", "beam", "T_env", size=4.0, full=100.0),
            Spare("P_lamps", "input_heat", "granite_top", size=15.0, full=300.0),
            Spare("P_lamps", "input_path", output="E_Z", size=2.0, full=300.0),
        ),
        work=("P_drives", "P_lamps"),
    )


def _cycle(rng: Draw, hours: float) -> Inputs:
    """Days: people, lamps and sun warm the room from the morning on, nights are cool; runs of measuring."""
    step = PACE.step_s
    n, start = round(hours * 3600 / step), rng.uniform(0, 24)
    day = shifts(rng, n, step, start)
    people = day * levels(rng, n, step, 1.0, 4.0, lambda: rng.uniform(0.2, 1.0))
    clock = start + np.arange(n) * step / 3600.0
    sun = np.clip(np.sin(2 * np.pi * (clock - 8.0) / 24.0), 0.0, None) * (
        0.4 + 0.6 * levels(rng, n, step, 2.0, 24.0, rng.uniform)
    )
    slow = room(rng, n, step, rng.uniform(19.8, 20.8), rng.uniform(0.1, 0.3), 0.3)
    pulses = 0.12 * np.sign(
        np.sin(2 * np.pi * clock / rng.uniform(0.3, 0.9) + noise(rng, n, step, 3600.0, 1.0))
    )
    warm = lagged(
        rng.uniform(0.6, 1.6) * people + rng.uniform(0.3, 1.2) * sun + pulses, step, rng.uniform(900, 2700)
    )
    busy = day * levels(rng, n, step, 0.3, 3.0, lambda: float(rng.uniform() < 0.6))
    return {
        "T_env": slow + warm,
        "P_people": 100.0 * people,
        "P_drives": busy * levels(rng, n, step, 0.2, 1.5, lambda: rng.uniform(15, 60)),
        "P_lamps": day * levels(rng, n, step, 1.0, 6.0, lambda: float(rng.choice([0.0, 150.0, 300.0]))),
        "fan_room": levels(rng, n, step, 2.0, 12.0, lambda: float(rng.choice([0.0, 35.0, 70.0, 100.0]))),
    }
