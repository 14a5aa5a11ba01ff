"""Units as loggers and spreadsheets write them, and which quantities have them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping

from discovery.firsthour.vocabulary import fold, words_of
from discovery.recordings.units import multiple, parse_unit

# spelled as here once folded (small letters, signs of degrees alike) -> as pint knows it
_SPELLED = {
    "degC": "°c c degc celsius degcelsius deg.c deg_c grad gradc gradcelsius °celsius 度 摂氏 oc ℃",
    "degF": "°f f degf fahrenheit deg.f °fahrenheit 華氏",
    "K": "k kelvin °k",
    "delta_degC": "deltak dk",
    "percent": "% pct perc percent prozent proz. パーセント %pwm %rh %r.h. %rf vh",
    "rpm": "rpm 1/min u/min u/min. umin upm r/min rev/min min-1 min^-1 min⁻¹ /min tr/min giri/min "
    "ob/min obr/min ot/min varv/min omw/min o/min 回転/分 r.p.m.",
    "1/s": "1/s s-1 s^-1 s⁻¹ rps rev/s",
    "W": "w watt watts ワット",
    "kW": "kw kilowatt",
    "mW": "mw",
    "W/m**2": "wm2 wm-2",
    "hp": "hp ps cv",
    "um": "um µm μm micron microns micrometer mikrometer mkm ミクロン マイクロメートル",
    "mm": "mm millimeter millimetre ミリ",
    "nm": "nm",
    "m": "m meter metre",
    "inch": "in inch inches",
    "thou": "mil mils thou thousandths",
    "um/m": "um/m µm/m μm/m µrad μrad urad microrad",
    "mm/m": "mm/m mrad",
    "l/min": "nl/min nl/m nlpm nlm ln/min slm sl/min "
    "l/min lpm l/m liter/min litre/min lit/min l/min. l·min-1 l/分 slpm",
    "kg/min": "kg/min",
    "kg/s": "kg/s kg·s-1",
    "g/s": "g/s",
    "kg/h": "kg/h kg/hr",
    "l/h": "l/h lph liter/h l/hr",
    "m**3/h": "m3/h m^3/h m³/h cbm/h",
    "m**3/s": "m3/s m³/s",
    "gal/min": "gpm gal/min",
    "A": "a amp amps ampere amperes アンペア",
    "mA": "ma",
    "V": "v volt volts ボルト",
    "mV": "mv",
    "N*m": "nm. n·m n*m n-m newtonmeter",
    "N": "n newton",
    "bar": "bar",
    "mbar": "mbar",
    "Pa": "pa",
    "kPa": "kpa",
    "MPa": "mpa",
    "psi": "psi",
    "Hz": "hz",
    "m/s": "m/s",
    "mm/min": "mm/min",
    "m/min": "m/min",
    "kWh": "kwh",
    "Wh": "wh",
    "A*h": "ah",
    "1": "- 1 – — [-] -/- bool boolean 0/1 0|1 1/0 on/off off/on ein/aus aus/ein sí/no si/no oui/non",
}
_KNOWN = {word: unit for unit, words in _SPELLED.items() for word in words.split()}
_KNOWN |= {"Nm": "N*m", "NM": "N*m"}  # in small letters a length
TIME_UNITS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
_TIMES = {
    "ns": "ns nsec nanoseconds nanosekunden",
    "us": "us µs μs usec microseconds mikrosekunden",
    "ms": "ms msec msecs millis milliseconds millisecond millisekunden millisek ミリ秒 毫秒",
    "s": "s sec secs seconds second sek sekunde sekunden secondes secondi segundos 秒 秒数 秒間 초 сек sec.",
    "min": "min mins minute minutes minuten min. minuti minutos 分 分鐘 分钟 분 мин",
    "h": "h hr hrs hour hours std std. stunde stunden heure heures ora ore hora horas "
    "時間 小时 小時 시간 час часы",
    "d": "d day days tag tage jour jours giorno giorni dia dias 日 天 일",
}
_TIME = {word: unit for unit, words in _TIMES.items() for word in words.split()}
# what a clock is called
CLOCKS = re.compile(
    r"\b(time|zeit|datetime|timestamp|zeitstempel|date|datum|elapsed|seconds|minutes|hours|clock|stamp|uhrzeit|"
    r"sekunden|minuten|stunden|laufzeit|messzeit|heure|temps|fecha|tiempo|tempo|ora|data|orario|tijd|czas|cas|horodatage|tid|t)\b|"
    r"(time|zeit|stamp)\b|zeit\b|時刻|時間|日時|日付|経過|时间|日期|시간|время|дата"
)
_DATE = re.compile(r"\b(date|datum|data|fecha|dato|dia|tag|jour|giorno)\b|дата|日付|日期")
DEGREES = ("degC", "degF", "K", "0.1 degC", "0.01 degC")  # controllers count in parts of a degree
# symbols of quantities in formulas, by the unit of one letter behind them: F_N, U_V, x_m
_SYMBOLS = {"N": "f", "V": "u e", "A": "i", "W": "p q", "C": "t", "K": "t", "F": "t", "m": "x y z s h l"}


def _folded(written: str) -> str:
    text = written.strip().replace("º", "°").replace("˚", "°").replace("℃", "°C").replace("℉", "°F")
    return re.sub(r"\s+", "", unicodedata.normalize("NFKC", text)).replace("−", "-").casefold().strip("[]()")


def known_unit(written: str) -> str | None:
    """The unit of a list that a text spells, or None.

    >>> known_unit("℃"), known_unit("U/min"), known_unit("[Nm]"), known_unit("nm"), known_unit("quux")
    ('degC', 'rpm', 'N*m', 'nm', None)
    """
    return _KNOWN.get(written.strip("[]() ")) or _KNOWN.get(_folded(written))


def time_unit(written: str) -> str | None:
    """A unit of time that a text spells, or None.

    >>> time_unit("Min."), time_unit("経過時間") is None, time_unit("分"), time_unit("sek")
    ('min', True, 'min', 's')
    """
    return _TIME.get(_folded(written)) or _TIME.get(_folded(written).rstrip("."))


def unit_of(written: str) -> tuple[str, str | None]:
    """A unit as written, corrected where loggers leave out a sign (W/m2), and as one of the list, or
    None.
    """
    spelled = re.sub(
        r"(?<=[a-zA-Z])(?=[2-4](?!\w))", "**", written.strip().replace("º", "°").replace("˚", "°")
    )
    return spelled, known_unit(written)


def is_unit(written: str) -> bool:
    """Whether a text is a unit, of the list or one that pint knows.

    >>> is_unit("°C"), is_unit("ohm"), is_unit("Unit"), is_unit("")
    (True, True, False, False)
    """
    spelled, known = unit_of(written)
    try:
        return known is not None or bool(parse_unit(spelled))
    except ValueError:
        return False


def unit_in(header: str) -> tuple[str, str] | None:
    """Name and unit of a header such as ``Bed temp [°F]``, ``P_drive (kW)``, ``Zeit in s``, ``T1_degC``,
    or None.

    >>> unit_in("Bed temp [°F]"), unit_in("T1_degC"), unit_in("主軸温度（℃）"), unit_in("x [table]")
    (('Bed temp', '°F'), ('T1', 'degC'), ('主軸温度', '℃'), None)
    >>> unit_in("F_N"), unit_in("Heater_A"), unit_in("v_x_m_min"), unit_in("T1_min")
    (('F', 'N'), None, ('v_x', 'm/min'), None)
    >>> unit_in("time_h"), unit_in("T_h"), unit_in("q_W_m2")
    (('time', 'h'), None, ('q', 'W/m2'))
    >>> unit_in("oil_C"), unit_in("coolant_flow_C"), unit_in("hall_A")
    (('oil', 'C'), None, None)
    >>> unit_in("T_f"), unit_in("T_F"), unit_in("temp_f")
    (None, ('T', 'F'), ('temp', 'f'))
    >>> unit_in("oil_in"), unit_in("T_in"), unit_in("Disp X in"), unit_in("x [in]")
    (None, None, ('Disp X', 'in'), ('x', 'in'))
    >>> unit_in("solarrad_Wm2"), unit_in("relhum_perc")
    (('solarrad', 'Wm2'), ('relhum', 'perc'))
    >>> unit_in("CPU_Power_W_Actual"), unit_in("speed_rpm_set"), unit_in("axis_C_motor")
    (('CPU_Power_Actual', 'W'), ('speed_set', 'rpm'), None)
    """
    for form in _WITH_UNIT:
        found = form.fullmatch(header)
        if not found or not found[1].strip():
            continue
        name, unit = found[1].strip(), re.sub(r"(?<=[^\W_])_(?=[^\W_])", "/", found[2].strip())
        meant = form in _WITH_UNIT[:2] or _is_symbol(name, unit)
        if (_is_unit(unit, meant) and (meant or _belongs(name, unit))) or _of_a_clock(name, unit):
            return name, unit
        if meant and _is_range(name, unit):
            return name, unit
    return _before_a_word(header)


def _before_a_word(header: str) -> tuple[str, str] | None:
    """Name and unit where a word that names no quantity stands behind the unit, as in P_W_actual."""
    front, _, last = header.rpartition("_")
    names_one = any(odds > 0 for word in words_of(last) for odds in word.says.values())
    if not front or names_one or not re.fullmatch(r"[^\W\d_]{3,}", last) or _is_unit(last, True):
        return None
    found = unit_in(front)
    if found is None or time_unit(found[1]):  # T_min_left is the least temperature
        return None
    return f"{found[0]}_{last}", found[1]


def _of_a_clock(name: str, unit: str) -> bool:
    """Whether a letter behind a word for time is its unit: time_h, but not T_h, which may be hot.

    >>> _of_a_clock("time", "h"), _of_a_clock("T", "h"), _of_a_clock("Fecha", "h")
    (True, False, False)
    """
    words = re.sub(r"\bt\b", "", fold(name))
    return time_unit(unit) is not None and not is_dated(name) and bool(CLOCKS.search(words))


def _is_range(name: str, unit: str) -> bool:
    """Whether a whole number with a unit belongs to what a name says: AI1 [10 V], but not T_air (2 m)."""
    found = multiple(unit)
    has = dimension_of(known_unit(found[1]) or "") if found else {}
    says = {quantity for word in words_of(name) for quantity, odds in word.says.items() if odds > 1.5}
    return bool(has) and (not says or bool(has.keys() & says))


def _is_symbol(name: str, unit: str) -> bool:
    """Return whether a name ends with the symbol that formulas use for this unit: F_N, U_V."""
    return fold(name).split()[-1:] in [[letter] for letter in _SYMBOLS.get(unit, "").split()]


def _belongs(name: str, unit: str) -> bool:
    """Whether a word behind a name is its unit: T1_C and oil_C are temperatures, Heater A is one of two,
    `Data/ora` and `Fecha y hora` are the date and the time of day.
    """
    if time_unit(unit) and (is_dated(name) or not CLOCKS.search(fold(name))):
        return False
    if re.fullmatch("[A-Z]", name) and re.fullmatch("[a-z]", unit):  # T_f: a fluid, not degF
        return False
    if (len(unit) > 1 and unit.casefold() != "in") or unit in "%°":  # an inlet is more common than an inch
        return True
    has = dimension_of(known_unit(unit) or "")
    says = {key for word in words_of(name) for key, odds in word.says.items() if odds > 1.5}
    if "temperature" in has and says and says <= {"air", "fluid", "coolant"}:  # nothing but where it is
        return True
    return bool(has.keys() & says) or (time_unit(unit) is not None and bool(CLOCKS.search(fold(name))))


_WITH_UNIT = (
    re.compile(r"(.*?)\s*[\[(（［【<]([^\])）］】>]*)[\])）］】>]\s*\.?"),
    re.compile(r"(.*?)_([mk]?W_m2)"),
    re.compile(r"(.*?)\s+in\s+(\S+)"),
    re.compile(r"(.*?)\s*[,/:]\s*(\S+)"),
    re.compile(r"(.*?)_([^\W\d_]{1,2}_(?:min|s|h|m))"),
    re.compile(r"(.*?)[_ ]([^\s_]+(?:/[^\s_]+)?)"),
)


def is_dated(name: str) -> bool:
    """Whether a name holds a word for date: an hour in it is then the time of day, no unit.

    >>> is_dated("Data/ora"), is_dated("Tempo (ore)")
    (True, False)
    """
    return bool(_DATE.search(fold(name)))


def steps_in(written: str) -> tuple[float, str] | None:
    """Factor and unit of what counts in steps of a unit; None for a unit itself, and for what may be a range.

    A whole number without a sign may be the range of an input, or a height: AI1 [10 V], T_air (2 m).

    >>> steps_in("2.5 um"), steps_in("x10 mV"), steps_in("1/10 °C"), steps_in("10 V"), steps_in("2 m")
    ((2.5, 'um'), (10.0, 'mV'), (0.1, '°C'), None, None)
    """
    found = multiple(written)
    if found is None or not (known_unit(found[1]) or time_unit(found[1]) or _is_unit(found[1], True)):
        return None
    signed = re.search("[x×*·]", written.removesuffix(found[1]))
    return found if signed or found[0] != round(found[0]) else None


def _is_unit(written: str, bracketed: bool) -> bool:
    """Whether a text is a unit; in brackets it may also be steps of one, or one that pint knows."""
    written = written.strip()
    if bracketed and steps_in(written):
        return True
    if known_unit(written) or time_unit(written):
        return bracketed or _folded(written) not in ("1", "-", "m", "n", "h", "d")
    if not bracketed:
        return False
    try:
        parse_unit(unit_of(written)[0])
    except ValueError:
        return bool(re.search(r"[/°%]|\d$", written)) and not re.search(r"\s", written)
    return True


def dimension_of(unit: str) -> Mapping[str, float]:
    """Log odds of the quantities that have a unit, as pint knows it; empty for one that says nothing."""
    if unit in _ODDS:
        return _ODDS[unit]
    try:
        given = parse_unit(unit)
    except ValueError:
        return {}
    for like, odds in _ODDS.items():
        try:
            if like not in ("1", "percent") and given.is_compatible_with(parse_unit(like)):
                return odds
        except ValueError:
            continue
    return {} if given.dimensionless else {"other": 9, "torque": 4, "position": 3}


_T, _W, _A, _V = {"temperature": 12}, {"power": 12}, {"current": 12}, {"voltage": 12}
_ODDS: dict[str, Mapping[str, float]] = {
    "degC": _T,
    "degF": _T,
    "K": _T,
    "W": _W,
    "A": _A,
    "V": _V,
    "rpm": {"speed": 12},
    "1/s": {"speed": 6, "other": 6},
    "um": {"displacement": 9, "correction": 7, "position": 3},
    "mm": {"displacement": 5, "correction": 4, "nozzle height": 4, "position": 6},
    "m": {"position": 9, "displacement": -1},
    "um/m": {"displacement": 9, "correction": 7},
    "l/min": {"flow": 12},
    "kg/min": {"flow": 12},
    "percent": {
        "signal": 3,
        "flow": 1.5,
        "power": 2.5,
        "other": 1,
        "torque": 2,
        "speed": 0,
        "temperature": -9,
        "displacement": -9,
        "current": -3,
        "voltage": -3,
    },
    "N*m": {"torque": 12},
    "N": {"torque": 10},
    "bar": {"other": 12},
    "m/s": {"position": 8, "other": 7},
    "1": {"temperature": -3, "displacement": -4, "current": -3, "voltage": -3},
    "W/m**2": {"other": 12},
}
