"""What answers to what: the water of a boiler is measured, the water that flows in is brought along."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.firsthour.answering import explained_by
from discovery.firsthour.table import Column
from discovery.firsthour.tableguess import guess_all

Array = NDArray[np.float64]
ROWS, STEP = 2000, 10.0  # s


def boiler(seed: int) -> tuple[Array, Array, Array, Array, Array]:
    """Heater [W], flow [l/min], temperatures of inlet, room and tank [degC]: 60 l, by Euler's method."""
    rng = np.random.default_rng(seed)
    heater = np.repeat(rng.choice([0.0, 1000.0, 3000.0], 10), ROWS // 10)
    flow = np.repeat(rng.choice([0.0, 1.0, 3.0], 20), ROWS // 20)
    inlet = 12.0 + np.cumsum(rng.normal(0.0, 0.01, ROWS))
    room = 21.0 + np.sin(np.arange(ROWS) / 1400.0 + seed)
    tank = np.full(ROWS, 35.0)
    for k in range(ROWS - 1):
        carried = 4186.0 / 60.0 * flow[k] * (tank[k] - inlet[k])
        tank[k + 1] = tank[k] + STEP / (60.0 * 4186.0) * (heater[k] - carried - 4.5 * (tank[k] - room[k]))
    read = rng.normal(0.0, 0.1, (3, ROWS))
    return heater, flow, inlet + read[0], room + read[1], tank + read[2]


@pytest.mark.parametrize("seed", range(5))
def test_the_tank_of_a_boiler_is_what_is_measured(seed: int) -> None:
    heads = ("heater_W", "flow_l_min", "inlet_degC", "room_degC", "tank_degC")
    units = ("W", "l/min", "degC", "degC", "degC")
    columns = [Column(h, h, u, v) for h, u, v in zip(heads, units, boiler(seed), strict=True)]
    found = {name: one.role for name, one in guess_all(columns).items()}
    assert found == {
        "heater_W": "heat load",
        "flow_l_min": "fluid flow",
        "inlet_degC": "fluid temperature",
        "room_degC": "ambient temperature",
        "tank_degC": "temperature",
    }


def test_a_fluid_stays_one_where_a_body_is_measured() -> None:
    heater, flow, _, _, tank = boiler(0)
    columns = [
        Column("heater", "heater", "W", heater),
        Column("flow", "flow", "l/min", flow),
        Column("coolant", "coolant", "degC", tank),
        Column("spindle nose", "spindle_nose", "degC", tank + 3.0),
    ]
    found = guess_all(columns)
    assert found["spindle_nose"].role == "temperature"
    assert found["coolant"].role != "temperature"


def test_a_slow_drift_is_no_answer() -> None:
    heater, flow, inlet, room, tank = boiler(1)
    shares = [explained_by(one, [heater, flow]) for one in (inlet, room, tank)]
    assert shares[2] > 0.7
    assert max(shares[:2]) < 0.1


def test_cells_that_are_empty_count_as_unchanged() -> None:
    heater, flow, _, _, tank = boiler(2)
    sparse = np.where(np.arange(ROWS) % 5 == 0, heater, np.nan)
    assert explained_by(tank, [sparse, flow]) == pytest.approx(explained_by(tank, [heater, flow]), abs=0.05)
    empty = np.full(ROWS, np.nan)
    assert explained_by(tank, [heater, flow, empty]) == pytest.approx(explained_by(tank, [heater, flow]))
    assert explained_by(empty, [heater]) == 0.0
    assert explained_by(np.full(ROWS, 3.0), [heater]) == 0.0
