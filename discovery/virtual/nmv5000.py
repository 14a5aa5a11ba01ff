"""The campaign of the virtual machine that the experiments use: the recordings that the paper speaks of."""

from __future__ import annotations

from discovery.virtual.effects import Request
from discovery.virtual.record import Order

TITLE = "virtual NMV 5000, cutting fluid"

# The nozzle on the left throws most of the fluid onto the structure: B-Body 1 and 2 are splashed.
LEFT = (
    Request("fluid_convection", 0.8, ("b_body_1",)),
    Request("fluid_convection", 0.4, ("b_body_2",)),
)

ORDERS = (
    Order("fit", "fit", 1, note="random cycle, fluid on and warm, nozzle at 50 mm"),
    Order("validation", "validation", 2, note="second random cycle, nozzle at 50 mm"),
    Order("left_nozzle", "fit", 3, effects=LEFT, note="nozzle on the left side, fluid on the structure"),
    Order("height_100", "validation", 4, nozzle_height_mm=100.0, note="nozzle at 100 mm"),
    Order("dry", "dry", 5, note="random cycle without fluid"),
    Order("only_environment", "environment", 6, hours=48.0, note="only the room changes, machine at rest"),
    Order("only_fluid", "fluid", 7, hours=48.0, note="only the fluid changes, table at 60 rpm"),
    Order("only_load", "internal", 8, hours=48.0, note="only the drive works, pump off, room held"),
    Order(
        "warm_up", "warm_up", 9, hours=25.0, note="600 rpm for 15 h, then 10 h at rest, under fluid: figure 3"
    ),
)

CAMPAIGNS = {"nmv5000": (TITLE, ORDERS)}
