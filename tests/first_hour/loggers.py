"""Files in the form of well-known loggers and programs, made of recordings of this repository.

Each has three runs of the two heaters (real), under names that a workshop would type into the logger.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

from tests.first_hour.shopfloor import BEGIN, RUNS, Floor, Row, from_files, heaters, rows

HEATER_1, HEATER_2, ONE, OTHER = "heater1", "heater2", "T1", "T2"
VALUES = (HEATER_1, HEATER_2, ONE, OTHER)


def _runs() -> list[tuple[datetime, list[Row]]]:
    return [(BEGIN + timedelta(days=k), rows("tclab", name, 3)) for k, name in enumerate(RUNS)]


def _number(row: Row, name: str) -> float:
    return row[name] or 0.0


def _written(folder: Path, ending: str, texts: Sequence[str], encoding: str = "utf-8") -> tuple[str, ...]:
    files = []
    for k, text in enumerate(texts):
        files.append(folder / f"run{k + 1}.{ending}")
        files[-1].write_bytes(text.encode(encoding))
    return from_files(files)


def graphtec(folder: Path) -> Floor:
    """Graphtec midi LOGGER: settings first, names and units in two rows, a blank after the sign."""
    texts = []
    for begin, run in _runs():
        lines = [
            "Vendor,GRAPHTEC Corporation",
            "Model,GL240",
            "Version,Ver1.20",
            "Sampling interval,3s",
            f"Total data points,{len(run)}",
            f"Start time,{begin:%Y/%m/%d},{begin:%H:%M:%S}",
            f"End time,{begin:%Y/%m/%d},{begin + timedelta(seconds=_number(run[-1], 'time')):%H:%M:%S}",
            f"Trigger time,{begin:%Y/%m/%d},{begin:%H:%M:%S}",
            "AMP settings",
            "CH,Signal name,Input,Range,Filter,Span",
            "CH1,Heater 1,DC,10V,Off,100.0,0.0,%",
            "CH2,Heater 2,DC,10V,Off,100.0,0.0,%",
            "CH3,Plate 1,TEMP,TC_K,Off,100.0,0.0,degC",
            "CH4,Plate 2,TEMP,TC_K,Off,100.0,0.0,degC",
            "Logic/Pulse,Off",
            "Data",
            "Number,Date&Time,ms,CH1,CH2,CH3,CH4,Alarm1-10,AlarmOut",
            "NO.,Time,ms,%,%,degC,degC,A1234567890,A1234",
        ]
        for k, row in enumerate(run):
            at = begin + timedelta(seconds=_number(row, "time"))
            cells = [f"{'-' if _number(row, c) < 0 else '+'}{abs(_number(row, c)):7.2f}" for c in VALUES]
            lines.append(
                ",".join([str(k + 1), f"{at:%Y/%m/%d %H:%M:%S}", "000", *cells, "LLLLLLLLLL", "LLLL"])
            )
        texts.append("\r\n".join(lines) + "\r\n")
    return Floor(_written(folder, "csv", texts), heaters("CH1", "CH2", "CH3", "CH4"), 2.138)


def benchlink(folder: Path) -> Floor:
    """Keysight BenchLink Data Logger: UTF-16, a table of channels, milliseconds behind a colon."""
    texts = []
    for begin, run in _runs():
        lines = [
            "Name:,plates",
            'Owner:,"lab"',
            "Comments:,",
            f"Acquisition Date:,{begin:%m/%d/%Y %H:%M:%S}",
            "Instrument:,34972A,Address:,USB0",
            "Channel,Name,Function,Range,Resolution,Advanced Settings,Scale,Gain,Offset,Label",
            "101,heater 1,DC volts,10,5.5 digits,,Yes,10,0,%",
            "102,heater 2,DC volts,10,5.5 digits,,Yes,10,0,%",
            "103,plate 1,Temp (Type K),K,,,No,,,C",
            "104,plate 2,Temp (Type K),K,,,No,,,C",
            "",
            "Scan,Time,101 <heater 1> (%),Alarm 101,102 <heater 2> (%),Alarm 102,103 <plate 1> (C),Alarm 103,"
            "104 <plate 2> (C),Alarm 104",
        ]
        for k, row in enumerate(run):
            at = begin + timedelta(seconds=_number(row, "time"))
            cells = [f"{_number(row, c):.3f},0" for c in VALUES]
            lines.append(
                ",".join([str(k + 1), f"{at:%m/%d/%Y %H:%M:%S}:{at.microsecond // 1000:03d}", *cells])
            )
        texts.append("\r\n".join(lines) + "\r\n")
    roles = heaters("x_101_heater_1", "x_102_heater_2", "x_103_plate_1", "x_104_plate_2")
    return Floor(_written(folder, "csv", texts, "utf-16"), roles, 2.138)


def labview(folder: Path) -> Floor:
    """LabVIEW measurement file: two headers, tabs, a comment column."""
    texts = []
    for begin, run in _runs():
        lines = [
            "LabVIEW Measurement\t",
            "Writer_Version\t2",
            "Reader_Version\t2",
            "Separator\tTab",
            "Decimal_Separator\t.",
            "Multi_Headings\tNo",
            "X_Columns\tOne",
            "Time_Pref\tRelative",
            "Operator\tlab",
            f"Date\t{begin:%Y/%m/%d}",
            f"Time\t{begin:%H:%M:%S}.0000000000000000000",
            "***End_of_Header***\t",
            "\t",
            "Channels\t4\t\t\t\t",
            "Samples\t" + "\t".join(4 * [str(len(run))]) + "\t",
            "Date\t" + "\t".join(4 * [f"{begin:%Y/%m/%d}"]) + "\t",
            "Time\t" + "\t".join(4 * [f"{begin:%H:%M:%S}.0"]) + "\t",
            "Y_Unit_Label\t%\t%\tDeg C\tDeg C\t",
            "X_Dimension\tTime\tTime\tTime\tTime\t",
            "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t0.0000000000000000E+0\t0.0000000000000000E+0\t",
            "Delta_X\t3.000000\t3.000000\t3.000000\t3.000000\t",
            "***End_of_Header***\t\t\t\t\t",
            "X_Value\tHeater 1\tHeater 2\tPlate 1\tPlate 2\tComment",
        ]
        lines += [
            "\t".join([f"{_number(row, 'time'):.6f}", *(f"{_number(row, c):.6f}" for c in VALUES), ""])
            for row in run
        ]
        texts.append("\r\n".join(lines) + "\r\n")
    return Floor(_written(folder, "lvm", texts), heaters("Heater_1", "Heater_2", "Plate_1", "Plate_2"), 2.138)


def hobo(folder: Path) -> Floor:
    """HOBOware: a title, the time zone and serial numbers in the names, twelve hours, columns of events."""
    texts = []
    for k, (begin, run) in enumerate(_runs()):
        serial = "(LGR S/N: 10345678, SEN S/N: 1034567{}, LBL: {})"
        said = ["Output, % ", "Output, % ", "Temp, °C ", "Temp, °C "]
        labels = ["Heater 1", "Heater 2", "Plate 1", "Plate 2"]
        header = [
            f'"{n}{serial.format(i, label)}"' for i, (n, label) in enumerate(zip(said, labels, strict=True))
        ]
        lines = [
            f'"Plot Title: run {k + 1}"',
            ",".join(
                [
                    '"#"',
                    '"Date Time, GMT+01:00"',
                    *header,
                    '"Coupler Attached (LGR S/N: 10345678)"',
                    '"End Of File (LGR S/N: 10345678)"',
                ]
            ),
        ]
        for i, row in enumerate(run):
            at = begin + timedelta(seconds=_number(row, "time"))
            end = "Logged" if i == len(run) - 1 else ""
            lines.append(
                ",".join(
                    [
                        str(i + 1),
                        f"{at:%m/%d/%y %I:%M:%S %p}",
                        *(f"{_number(row, c):.3f}" for c in VALUES),
                        "",
                        end,
                    ]
                )
            )
        texts.append("\ufeff" + "\n".join(lines) + "\n")
    names = (
        "Output_SEN_10345670_LBL_Heater_1",
        "Output_SEN_10345671_LBL_Heater_2",
        "Temp_SEN_10345672_LBL_Plate_1",
        "Temp_SEN_10345673_LBL_Plate_2",
    )
    return Floor(_written(folder, "csv", texts), heaters(*names), 2.138)


def almemo(folder: Path) -> Floor:
    """Ahlborn ALMEMO: German, ranges, comments and units in rows with colons, 'C for a degree."""
    texts = []
    for begin, run in _runs():
        lines = [
            "ALMEMO 2890-9;;;;;",
            ";BEREICH:;DIGI;DIGI;NiCr;NiCr",
            ";KOMMENTAR:;Heizung 1;Heizung 2;Platte 1;Platte 2",
            ";GW-MAX:;;;;",
            ";GW-MIN:;;;;",
            "DATUM:;ZEIT:;M00: %;M01: %;M02: °C;M03: °C",
        ]
        for row in run:
            at = begin + timedelta(seconds=_number(row, "time"))
            lines.append(
                ";".join(
                    [f"{at:%d.%m.%y;%H:%M:%S}", *(f"{_number(row, c):.1f}".replace(".", ",") for c in VALUES)]
                )
            )
        texts.append("\r\n".join(lines) + "\r\n")
    return Floor(_written(folder, "csv", texts, "cp1252"), heaters("M00", "M01", "M02", "M03"), 2.138)


def scope(folder: Path) -> Floor:
    """TwinCAT Scope: a clock of its own (ms) next to each channel, settings in rows."""
    texts = []
    names = ("MAIN.fHeater1", "MAIN.fHeater2", "MAIN.fTemp1", "MAIN.fTemp2")
    for begin, run in _runs():
        doubled = [
            ("Name", names),
            ("Data-Type", 4 * ("REAL64",)),
            ("SampleTime[ms]", 4 * ("3000",)),
            ("Unit", ("%", "%", "°C", "°C")),
        ]
        lines = [
            "Name\tScope Project",
            "File\tD:\\scope\\plates.svdx",
            f"Starttime of export\t{_filetime(begin)}\t{begin:%A, %d %B %Y}\t{begin:%H:%M:%S}",
            "",
            *("\t".join(f"{word}\t{value}" for value in values) for word, values in doubled),
            "",
        ]
        lines += [
            "\t".join(f"{1000 * _number(row, 'time'):.0f}\t{_number(row, c):.3f}" for c in VALUES)
            for row in run
        ]
        texts.append("\n".join(lines) + "\n")
    return Floor(_written(folder, "csv", texts), heaters(*(n.replace(".", "_") for n in names)), 2.138)


def _filetime(at: datetime) -> int:
    """100 ns since 1601."""
    return round((at.replace(tzinfo=UTC) - datetime(1601, 1, 1, tzinfo=UTC)).total_seconds()) * 10**7


def filetime(folder: Path) -> Floor:
    """Stamps in Microsoft's file time."""
    texts = []
    for begin, run in _runs():
        lines = ["time,heater_1_pct,heater_2_pct,temp_1_degC,temp_2_degC"]
        for row in run:
            at = begin + timedelta(seconds=_number(row, "time"))
            lines.append(",".join([str(_filetime(at)), *(f"{_number(row, c):.3f}" for c in VALUES)]))
        texts.append("\n".join(lines) + "\n")
    names = ("heater_1", "heater_2", "temp_1", "temp_2")
    return Floor(_written(folder, "csv", texts), heaters(*names), 2.138)


def picolog(folder: Path) -> Floor:
    """PicoLog 6: an unnamed column of ISO stamps with a time zone, averages in the names."""
    texts = []
    for begin, run in _runs():
        lines = ['"","Heater 1 Ave. (%)","Heater 2 Ave. (%)","Plate 1 Ave. (°C)","Plate 2 Ave. (°C)"']
        for row in run:
            at = begin + timedelta(seconds=_number(row, "time"))
            lines.append(
                ",".join([f"{at:%Y-%m-%dT%H:%M:%S}+01:00", *(f"{_number(row, c):.3f}" for c in VALUES)])
            )
        texts.append("\n".join(lines) + "\n")
    names = ("Heater_1_Ave", "Heater_2_Ave", "Plate_1_Ave", "Plate_2_Ave")
    return Floor(_written(folder, "csv", texts), heaters(*names), 2.138)


def grafana(folder: Path) -> Floor:
    """Grafana: the unit stands behind each value."""
    texts = []
    for begin, run in _runs():
        lines = ['"Time","heater 1","heater 2","plate 1","plate 2"']
        for row in run:
            at = begin + timedelta(seconds=_number(row, "time"))
            cells = [
                f"{_number(row, HEATER_1):.1f}%",
                f"{_number(row, HEATER_2):.1f}%",
                f"{_number(row, ONE):.2f} °C",
                f"{_number(row, OTHER):.2f} °C",
            ]
            lines.append(",".join([f"{at:%Y-%m-%d %H:%M:%S}", *cells]))
        texts.append("\n".join(lines) + "\n")
    return Floor(_written(folder, "csv", texts), heaters("heater_1", "heater_2", "plate_1", "plate_2"), 2.138)


def keyence(folder: Path) -> Floor:
    """Keyence NR: units below the names, what the channels are below the units, date and time apart."""
    texts = []
    for begin, run in _runs():
        lines = [
            "TITLE,NR-600",
            f"DATE,{begin:%Y/%m/%d}",
            "No.,Date,Time,(1)HA08 CH1,(1)HA08 CH2,(2)TH08 CH1,(2)TH08 CH2",
            ",,,%,%,degC,degC",
            ",,,heater 1,heater 2,plate 1,plate 2",
        ]
        for k, row in enumerate(run):
            at = begin + timedelta(seconds=_number(row, "time"))
            cells = [f"{_number(row, c):.3f}" for c in VALUES]
            lines.append(",".join([str(k), f"{at:%Y/%m/%d,%H:%M:%S.%f}", *cells]))
        texts.append("\r\n".join(lines) + "\r\n")
    names = ("x_1_HA08_CH1", "x_1_HA08_CH2", "x_2_TH08_CH1", "x_2_TH08_CH2")
    return Floor(_written(folder, "csv", texts, "shift_jis"), heaters(*names), 2.138)


def influx(folder: Path) -> Floor:
    """InfluxDB: rows of annotations, one reading a row."""
    texts = []
    for begin, run in _runs():
        lines = [
            "#group,false,false,true,true,false,false,true,true",
            "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string",
            "#default,last,,,,,,,",
            ",result,table,_start,_stop,_time,_value,_field,_measurement",
        ]
        until = begin + timedelta(seconds=_number(run[-1], "time"))
        names = ("heater_1_percent", "heater_2_percent", "plate_1_degC", "plate_2_degC")
        for table, (name, c) in enumerate(zip(names, VALUES, strict=True)):
            for row in run:
                at = begin + timedelta(seconds=_number(row, "time"))
                stamps = [f"{one:%Y-%m-%dT%H:%M:%S}Z" for one in (begin, until, at)]
                lines.append(",".join(["", "", str(table), *stamps, f"{_number(row, c):g}", name, "rig"]))
        texts.append("\r\n".join(lines) + "\r\n")
    names = ("heater_1", "heater_2", "plate_1", "plate_2")
    return Floor(_written(folder, "csv", texts), heaters(*names), 2.138)


LOGGERS: dict[str, Callable[[Path], Floor]] = {
    "graphtec": graphtec,
    "benchlink": benchlink,
    "labview": labview,
    "hobo": hobo,
    "almemo": almemo,
    "scope": scope,
    "filetime": filetime,
    "picolog": picolog,
    "grafana": grafana,
    "keyence": keyence,
    "influx": influx,
}
