"""Systems of other trades as their users would bring them: a lathe, two battery cells, a spring, a vessel, a
motor.

    python benchmarks/outsiders.py FOLDER      # writes FOLDER/lathe/run1.csv ... FOLDER/vessel/b.csv
    discovery new FOLDER/lathe/job --from FOLDER/lathe/run1.csv --from ...
    discovery run FOLDER/lathe/job/experiment.toml

None is in the form of the models of the tool: bodies of the lathe are bars cut into ten pieces with a sensor
at one of them; the open-circuit voltage of the cell is a curve; the spring is stiffer the further it is out;
the vessel is filled by a compressor and blown off through an orifice; the motor has dry friction and sticks;
the second cell warms up, and a drive cycle takes it over a curve of its open-circuit voltage.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

Array = np.ndarray


def held(rng: np.random.Generator, levels: list[float], rows: int, short: int, long: int) -> Array:
    """Levels that are held for a random number of rows."""
    found: list[float] = []
    while len(found) < rows:
        found += [float(rng.choice(levels))] * int(rng.integers(short, long))
    return np.array(found[:rows])


def lathe(rng: np.random.Generator, hours: float) -> pd.DataFrame:
    """Errors X and Z [um] of a spindle head on a column, eight sensors and the speed, once a minute.

    Head, column, bed and screw are bars of ten pieces (Fourier number of a piece and a minute 0.05 to 0.2).
    The bearings warm one end of the head by rpm**1.5, the motor the other by rpm; the screw by its own moves.
    """
    rows, pieces, fine = int(hours * 60), 10, 6
    rpm = held(rng, [0, 0, 800, 1500, 2500, 3500, 4500], rows, 15, 90)
    feed = np.where(rpm > 0, rng.uniform(0.2, 1.0) * held(rng, [0.0, 1.0, 1.0], rows, 10, 60), 0.0)
    minutes = np.arange(rows)
    room = 21 + rng.uniform(-1.5, 1.5) + 1.5 * np.sin(2 * np.pi * minutes / 1440 + rng.uniform(0, 6))
    coolant = room + 1.5 + 0.0006 * pd.Series(rpm).ewm(halflife=60).mean().to_numpy()
    conduct = {"head": 0.20, "column": 0.06, "bed": 0.05, "screw": 0.10}
    loss = {"head": 0.010, "column": 0.004, "bed": 0.003, "screw": 0.02}
    bars = {name: np.full(pieces, room[0]) for name in conduct}
    out = []
    for k in range(rows):
        b = bars
        s, z = b["screw"], np.linspace(0.0, 1.0, pieces)
        head, bed = np.mean(b["head"] - 20), np.mean(b["bed"] - 20)
        out.append(
            {
                "Spindle front": b["head"][1],
                "Spindle rear": b["head"][8],
                "Column top": b["column"][1],
                "Column bottom": b["column"][8],
                "Bed": b["bed"][4],
                "Ball screw nut": s[5],
                "Coolant": coolant[k],
                "Ambient": room[k],
                "X": 4.2 * head + 9.0 * np.mean((b["column"] - 20) * z) - 3.0 * bed,
                "Z": 5.5 * head - 6.0 * np.mean(s - 20) + 2.0 * bed,
            }
        )
        for _ in range(fine):
            flow = {n: np.diff(t) * conduct[n] / fine for n, t in b.items()}
            for n, t in b.items():
                change = -loss[n] / fine * (t - room[k])
                change[:-1] += flow[n]
                change[1:] -= flow[n]
                b[n] = t + change
            b["head"][:3] += 0.11 / fine * (rpm[k] / 3000) ** 1.5
            b["head"][7:] += 0.06 / fine * rpm[k] / 3000
            b["screw"] += 0.06 / fine * feed[k]
            b["bed"][:5] += 0.02 / fine * (coolant[k] - b["bed"][:5])
            exchange = 0.03 / fine * (b["head"][5] - b["column"][0])
            b["column"][0] += exchange
            b["head"][5] -= exchange * 0.5
    table = pd.DataFrame(out)
    spread = {c: 0.8 if c in ("X", "Z") else 0.08 for c in table}
    for c in table:
        table[c] -= table[c].iloc[0] if c in ("X", "Z") else 0.0
        table[c] = (table[c] + spread[c] * rng.standard_normal(rows)).round(2)
    table.insert(0, "Speed [rpm]", rpm)
    table = table.rename(columns={c: f"{c} [°C]" for c in table if c not in ("X", "Z", "Speed [rpm]")})
    table.insert(0, "Time [min]", minutes)
    return table.rename(columns={"X": "Error X [µm]", "Z": "Error Z [µm]"})


def battery(rng: np.random.Generator, hours: float) -> pd.DataFrame:
    """Voltage of a 5 Ah cell under current pulses (positive: discharge), each second."""
    rows = int(hours * 3600)
    current = held(rng, [-5.0, -2.0, 0.0, 0.0, 1.0, 2.5, 5.0, 7.5], rows, 20, 400) + held(
        rng, [0.0, 0.6], rows, 200, 900
    )
    soc, v1, v2, out = 0.85, 0.0, 0.0, []
    for i in current:
        ocv = 3.45 + 0.62 * soc + 0.12 * np.exp(-18 * (1 - soc)) - 0.35 * np.exp(-22 * soc)
        out.append(ocv - 0.024 * i - v1 - v2)
        v1 += 1.0 * (i * 0.012 - v1) / 22
        v2 += 1.0 * (i * 0.018 - v2) / 540
        soc = min(max(soc - i / 3600 / 5.0, 0.02), 0.99)
    volts = np.array(out) + 0.002 * rng.standard_normal(rows)
    return pd.DataFrame({"t [s]": np.arange(rows), "I [A]": current, "U [V]": volts.round(4)})


def spring(rng: np.random.Generator, seconds: float) -> pd.DataFrame:
    """Position [mm] of 0.5 kg on a spring of 1.2 N/mm that stiffens with the cube, force in N, 200 Hz."""
    fine, step = 10, 0.005
    rows = int(seconds / step)
    force = held(rng, [-8.0, -4.0, 0.0, 4.0, 8.0], rows, 40, 260)
    x, v, out = 0.0, 0.0, []
    for f in force:
        out.append(x)
        for _ in range(fine):
            h = step / fine  # half of the drift, the kick, half of the drift: of second order
            x += 0.5 * h * v
            v += h * (f - 1.2 * x - 0.02 * x**3 - 0.006 * v) / 0.5 * 1000.0 / (1 + 6.0 * h)
            x += 0.5 * h * v
    position = np.array(out) + 0.01 * rng.standard_normal(rows)
    return pd.DataFrame(
        {
            "Time (s)": (step * np.arange(rows)).round(4),
            "Force (N)": force,
            "Position (mm)": position.round(4),
        }
    )


def vessel(rng: np.random.Generator, hours: float) -> pd.DataFrame:
    """Pressure [bar] over the air of a vessel: a compressor fills it, an orifice blows off by a root."""
    rows = int(hours * 1200)
    feed = held(rng, [10.0, 30.0, 50.0, 70.0, 90.0], rows, 20, 160)
    p, out = 2.0, []
    for u in feed:
        out.append(p)
        for _ in range(10):
            p += 0.3 * (0.0011 * u - 0.022 * np.sqrt(max(p, 0.0)))
    pressure = np.array(out) + 0.01 * rng.standard_normal(rows)
    return pd.DataFrame(
        {"time": 3.0 * np.arange(rows), "compressor %": feed, "pressure bar": pressure.round(3)}
    )


def motor(rng: np.random.Generator, seconds: float) -> pd.DataFrame:
    """Current [A] and speed [rad/s] of a motor with dry friction (0.03 Nm) under voltage steps, 200 Hz."""
    rows, fine, step = int(seconds * 200), 200, 0.005
    volts = held(rng, [-24, -12, -6, -2, 0, 2, 6, 12, 24], rows, 60, 400)
    resistance, inductance, constant, inertia, viscous, dry = 1.2, 0.002, 0.05, 2e-4, 1e-4, 0.03
    i, w, out, h = 0.0, 0.0, [], step / fine
    for u in volts:
        out.append((i, w))
        for _ in range(fine):
            half = i + h / 2 * (u - resistance * i - constant * w) / inductance
            before, i = i, i + h * (u - resistance * half - constant * w) / inductance
            drive = constant * (before + i) / 2 - viscous * w
            if w == 0.0 and abs(drive) <= dry:
                continue
            after = w + h * (drive - dry * np.sign(w or drive)) / inertia
            w = 0.0 if w * after < 0 else after
    read = np.array(out)
    return pd.DataFrame(
        {
            "t [s]": (step * np.arange(rows)).round(4),
            "Voltage [V]": volts,
            "Current [A]": (read[:, 0] + 0.05 * rng.standard_normal(rows)).round(3),
            "Speed [rad/s]": (read[:, 1] + 0.5 * rng.standard_normal(rows)).round(2),
        }
    )


def driven_cell(rng: np.random.Generator, seconds: int) -> pd.DataFrame:
    """Voltage and temperature of a 20 Ah cell on drive cycles with pauses (discharge: positive), at 1 Hz."""
    base = held(rng, [0, 0, 2, 5, 8, 12, 20, -6, -12], seconds, 4, 40)
    current = np.convolve(np.r_[np.zeros(4), base], np.ones(5) / 5, "valid")[:seconds] + 1.0
    current[(np.arange(seconds) // 900) % 4 == 3] = 0.0
    soc, v1, v2, temperature, out = 0.92, 0.0, 0.0, 25.0, []
    for i in current:
        ocv = 3.0 + soc + 0.18 * np.exp(-20 * (1 - soc)) - 0.4 * np.exp(-20 * soc) - 0.08 * np.sin(5 * soc)
        out.append((ocv - 0.006 * i - v1 - v2, temperature))
        v1 += (i * 0.004 - v1) / 18
        v2 += (i * 0.005 - v2) / 320
        soc -= i / 72_000
        temperature += (0.015 * i * i - 0.25 * (temperature - 25.0)) / 180.0
    read = np.array(out)
    return pd.DataFrame(
        {
            "Time [s]": np.arange(seconds),
            "Current [A]": current.round(3),
            "Voltage [V]": (read[:, 0] + 0.002 * rng.standard_normal(seconds)).round(4),
            "Temperature [°C]": (read[:, 1] + 0.05 * rng.standard_normal(seconds)).round(2),
        }
    )


def main(folder: Path) -> None:
    rng = np.random.default_rng(20261122)
    made = {
        "lathe": {f"run{k}": lathe(rng, float(rng.uniform(5, 9))) for k in range(1, 13)},
        "battery": {name: battery(rng, 3.0) for name in ("a", "b", "c")},
        "spring": {name: spring(rng, 40.0) for name in ("a", "b", "c")},
        "vessel": {name: vessel(rng, 3.0) for name in ("a", "b", "c")},
    }
    rng = np.random.default_rng(20261123)  # written a day later
    made["motor"] = {name: motor(rng, 40.0) for name in ("a", "b", "c", "d")}
    made["driven_cell"] = {
        name: driven_cell(rng, 9000 + 1500 * k) for k, name in enumerate(("a", "b", "c", "d"))
    }
    for trade, tables in made.items():
        (folder / trade).mkdir(parents=True, exist_ok=True)
        for name, table in tables.items():
            table.to_csv(folder / trade / f"{name}.csv", index=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
