"""The campaign of the repository: the recordings that the paper describes, drawn once."""

from __future__ import annotations

from dataclasses import replace

from discovery.virtual.record import Order, Request

TITLE = "virtual NMV 5000, cutting fluid"
SEED = 20261122  # fixed before anything was run on these recordings; never changed since


def _order(
    k: int, name: str, cycle: str, hours: float, note: str, height: float = 50.0, side: float = 0.0
) -> Order:
    return Order(name, cycle, SEED + k, hours, height, side, note=note)


ORDERS = (
    _order(1, "fit", "fit", 72.0, "random cycle, fluid on and warm, nozzle at 50 mm"),
    _order(2, "validation", "validation", 72.0, "second random cycle, nozzle at 50 mm"),
    _order(
        3,
        "left_nozzle",
        "fit",
        72.0,
        "nozzle on the left: 30 % of the jet meets the table, the rest b_body_1 (20 W/K), "
        "b_body_2 (10 W/K) and a skin of both (25 W/K)",
        side=1.0,
    ),
    _order(4, "height_100", "validation", 72.0, "nozzle at 100 mm", height=100.0),
    _order(5, "dry", "dry", 72.0, "random cycle without fluid"),
    _order(6, "only_environment", "environment", 48.0, "only the room changes, machine at rest"),
    _order(7, "only_fluid", "fluid", 48.0, "only the fluid changes, table at 60 rpm"),
    _order(8, "only_load", "internal", 48.0, "only the drive works, pump off, room held"),
    _order(
        9, "only_load_wet", "load_wet", 48.0, "only the drive works, under fluid that is kept near the room"
    ),
    _order(
        10, "only_cooling", "cooling", 48.0, "only the set point of the axis cooling changes, machine at rest"
    ),
    _order(11, "warm_up", "warm_up", 25.0, "600 rpm for 15 h, then 10 h at rest, under fluid: figure 3"),
    _order(
        12, "warm_up_dry", "warm_up_dry", 25.0, "600 rpm for 15 h, then 10 h at rest, without fluid: figure 3"
    ),
    _order(
        13,
        "nozzle",
        "nozzle",
        24.0,
        "table at rest, warm fluid in pulses; height 20 to 400 mm and flow 2 to 14 l/min in steps",
    ),
    _order(
        14, "nozzle_flooded", "flooded", 24.0, "table turns under 8 to 16 l/min; height 20 to 400 mm in steps"
    ),
    _order(
        15,
        "left_nozzle_second",
        "validation",
        72.0,
        "nozzle on the left, second random cycle: to judge what was learned from the first",
        side=1.0,
    ),
    _order(16, "ten_days", "validation", 240.0, "random cycle of ten days, nozzle at 50 mm"),
    _order(17, "nozzle_long", "nozzle", 72.0, "as `nozzle`, three times as long"),
    replace(
        _order(18, "worn", "fit", 72.0, "random cycle of a machine whose drive losses fell by 20 %"),
        effects=tuple(Request("wear", 0.2, (body,)) for body in ("c_body_1", "c_body_2")),
        age=1.0,
    ),
)

# Of `make demo` alone: recorded after the program that it shows, from a seed that was fixed first
DEMONSTRATION_SEED = 20261201
DEMONSTRATION = tuple(
    replace(order, seed=order.seed - SEED + DEMONSTRATION_SEED)
    for order in ORDERS
    if order.name in ("fit", "validation", "left_nozzle")
)
CAMPAIGNS = {"nmv5000": (TITLE, ORDERS), "demonstration": (TITLE, DEMONSTRATION)}
