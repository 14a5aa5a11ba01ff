"""Files as shop floors have them, made of recordings of this repository: names, units, clocks and
encodings changed.

The two heaters are real; the lathe is the virtual machine under the names of a lathe logger.
"""

from __future__ import annotations

import csv
import gzip
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

DATASETS = Path(__file__).parents[2] / "datasets"
BEGIN = datetime(2026, 3, 2, 6, 12, 30)
RUNS = ("random_both_01", "random_h2_04", "step_h1_up_090")  # the last one stays unseen

Row = dict[str, float | None]


@dataclass(frozen=True)
class Floor:
    """`command`: `discovery new` and what follows. `roles`: channel -> role, unit. `hours`: of the first
    file.
    """

    command: tuple[str, ...]
    roles: dict[str, tuple[str, str]]
    hours: float


def rows(folder: str, name: str, every: int) -> list[Row]:
    """Every few rows of a recording."""
    with io.TextIOWrapper(gzip.open(DATASETS / folder / f"{name}.csv.gz")) as file:
        found = list(csv.DictReader(file))[::every]
    return [{k: float(v) if v else None for k, v in one.items()} for one in found]


def _write(path: Path, header: str, lines: Sequence[str], encoding: str = "utf-8") -> Path:
    path.write_bytes(("\n".join([header, *lines]) + "\n").encode(encoding))
    return path


def _plain(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


def _comma(value: float | None, digits: int = 2) -> str:
    return "" if value is None else f"{value:.{digits}f}".replace(".", ",")


def german(folder: Path) -> Floor:
    """Semicolons, decimal commas, day first, umlauts in latin-1."""
    header = "Datum;Uhrzeit;Heizung 1 [%];Heizung 2 [%];Temp. Fühler 1 [°C];Temp. Fühler 2 [°C]"
    files = []
    for k, name in enumerate(RUNS):
        lines = []
        for row in rows("tclab", name, 3):
            at = BEGIN + timedelta(days=k, seconds=row["time"] or 0.0)
            cells = [_comma(row[c]) for c in ("heater1", "heater2", "T1", "T2")]
            lines.append(";".join([f"{at:%d.%m.%Y;%H:%M:%S}", *cells]))
        files.append(_write(folder / f"Versuch_{k + 1}.csv", header, lines, "cp1252"))
    roles = heaters("Heizung_1", "Heizung_2", "Temp_Fuehler_1", "Temp_Fuehler_2")
    return Floor(from_files(files), roles, 2.138)


def japanese(folder: Path) -> Floor:
    """Shift-JIS, minutes, names and units in Japanese."""
    header = "経過時間(分),ヒーター1(%),ヒーター2(%),温度1(℃),温度2(℃)"
    files = []
    for k, name in enumerate(RUNS):
        lines = [
            f"{(row['time'] or 0) / 60:.4f},{row['heater1']},{row['heater2']},{row['T1']},{row['T2']}"
            for row in rows("tclab", name, 3)
        ]
        files.append(_write(folder / f"試験{k + 1}.csv", header, lines, "shift_jis"))
    return Floor(from_files(files), heaters("heat_1", "heat_2", "temp_1", "temp_2"), 2.138)


def american(folder: Path) -> Floor:
    """Month first, twelve hours, Fahrenheit without a unit in the name of one, a power in watts."""
    header = "Date,Time,Htr 1 Pwr (W),Htr 2 Pwr (W),Plate 1 Temp (F),Plate 2 Temp (F)"
    files = []
    for k, name in enumerate(RUNS):
        lines = []
        for row in rows("tclab", name, 3):
            at = BEGIN + timedelta(days=20 + k, seconds=row["time"] or 0.0)
            watts = [f"{4.0 * (row[c] or 0) / 100:.3f}" for c in ("heater1", "heater2")]
            degrees = [f"{1.8 * (row[c] or 0) + 32:.2f}" for c in ("T1", "T2")]
            lines.append(",".join([f"{at:%m/%d/%Y,%I:%M:%S %p}", *watts, *degrees]))
        files.append(_write(folder / f"run {k + 1}.csv", header, lines))
    loads = dict.fromkeys(("Htr_1_Pwr", "Htr_2_Pwr"), ("heat load", "W"))
    return Floor(
        from_files(files),
        loads | dict.fromkeys(("Plate_1_Temp", "Plate_2_Temp"), ("temperature", "degF")),
        2.138,
    )


def lathe(folder: Path) -> Floor:
    """`Time` in minutes without a word of it, kW, displacements as `Disp.`, a switch as ON and OFF."""
    header = "Time,Ambient,Coolant Temp,Coolant Pump,Spindle Speed,Spindle Power [kW],Disp. X,Disp. Z"
    files = []
    for k, name in enumerate(("fit", "height_100", "validation")):
        lines = []
        for row in rows("nmv5000", name, 5):
            pump = "ON" if (row["pump"] or 0) > 0.5 else "OFF"
            cells = [
                f"{(row['time'] or 0) / 60:g}",
                *(_plain(row[c]) for c in ("T_env", "T_fluid")),
                pump,
                _plain(row["speed"]),
                f"{(row['P_drive'] or 0) / 1e3:.4f}",
                *(_plain(row[c]) for c in ("E_Y0C", "E_Z0T")),
            ]
            lines.append(",".join(cells))
        files.append(_write(folder / f"lathe_{k + 1}.csv", header, lines))
    roles = {
        "Ambient": ("ambient temperature", "degC"),
        "Coolant_Temp": ("fluid temperature", "degC"),
        "Coolant_Pump": ("fluid flow", "1"),
        "Spindle_Speed": ("rotation speed", "rpm"),
        "Spindle_Power": ("heat load", "kW"),
        "Disp_X": ("error", "um"),
        "Disp_Z": ("error", "um"),
    }
    return Floor(from_files(files), roles, 72.0)


def two_loggers(folder: Path) -> Floor:
    """Temperatures every 15 s; what drives them every 20 s, by a clock that is 95 s ahead, in another
    form.
    """
    slow, fast = [], []
    for k, name in enumerate(RUNS):
        begin = BEGIN + timedelta(days=k)
        read = rows("tclab", name, 3)
        lines = [
            f"{begin + timedelta(seconds=row['time'] or 0.0):%Y-%m-%dT%H:%M:%S.%f},{row['T1']},{row['T2']}"
            for row in read
        ]
        slow.append(
            _write(folder / f"temperatures_{k + 1}.csv", "timestamp,T plate 1 [°C],T plate 2 [°C]", lines)
        )
        ahead = begin + timedelta(seconds=95)
        lines = [
            f"{ahead + timedelta(seconds=row['time'] or 0.0):%d.%m.%Y %H:%M:%S};"
            f"{_comma(row['heater1'])};{_comma(row['heater2'])}"
            for row in rows("tclab", name, 4)
        ]
        fast.append(_write(folder / f"drives_{k + 1}.csv", "Zeit;Heater 1 [%];Heater 2 [%]", lines))
    command = from_files(slow) + tuple(word for path in fast for word in ("--join", str(path)))
    return Floor(command, heaters("Heater_1", "Heater_2", "T_plate_1", "T_plate_2"), 2.138)


def heaters(first: str, second: str, one: str, other: str) -> dict[str, tuple[str, str]]:
    loads = dict.fromkeys((first, second), ("heat load", "percent"))
    return loads | dict.fromkeys((one, other), ("temperature", "degC"))


def from_files(files: Sequence[Path]) -> tuple[str, ...]:
    return tuple(word for path in files for word in ("--from", str(path)))


FLOORS: dict[str, Callable[[Path], Floor]] = {
    "german": german,
    "japanese": japanese,
    "american": american,
    "lathe": lathe,
    "two_loggers": two_loggers,
}
