"""What one cell of a table says: a number, a switch, "not measured", or a word."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NOTHING = frozenset(
    [
        "nan",
        "-nan",
        "inf",
        "-inf",
        "+inf",
        "na",
        "n/a",
        "n.a.",
        "null",
        "none",
        "nil",
        "nat",
        "<na>",
        "-",
        "--",
        "---",
        "----",
        "?",
        "*",
        "**",
        "***",
        "****",
        ".",
        "ol",
        "o.l",
        "+ol",
        "-ol",
        "over",
        "+over",
        "-over",
        "+++++",
        "-----",
        "burnout",
        "b.o",
        "b/o",
        "err",
        "err.",
        "error",
        "fault",
        "invalid",
        "bad",
        "missing",
        "undefined",
        "unknown",
        "unavailable",
        "overflow",
        "overload",
        "underflow",
        "underrange",
        "overrange",
        "no data",
        "nodata",
        "#n/a",
        "#nv",
        "#n/v",
        "#value!",
        "#div/0!",
        "#num!",
        "#ref!",
        "#wert!",
        "#bezug!",
        "#zahl!",
        "#null!",
        "k.a.",
        "n.v.",
        "ungültig",
        "ungueltig",
        "fehlt",
        "fehler",
        "unbekannt",
        "leer",
        "欠測",
        "無効",
        "異常",
        "断線",
        "未測定",
        "无效",
        "缺失",
    ]
)
# on, off
_SWITCHES = (
    "true false,on off,yes no,enabled disabled,active inactive,running stopped,run stop,start "
    "stop,open closed,"
    "opened closed,open shut,"
    "wahr falsch,ein aus,an aus,ja nein,aktiv inaktiv,auf zu,offen geschlossen,läuft steht,betrieb "
    "stillstand,"
    "vrai faux,marche arrêt,marche arret,oui non,ouvert fermé,activé désactivé,"
    "vero falso,acceso spento,sì no,si no,aperto chiuso,verdadero falso,encendido apagado,sí "
    "no,abierto cerrado,"
    "オン オフ,入 切,有 無,運転 停止,運転中 停止中,開 閉,真 偽,はい いいえ,開 关,开 关,是 否,真 假,启动 停止,"
    "运行 停止,"
    "켜짐 꺼짐,вкл выкл,да нет,истина ложь"
)
SWITCHES = {
    word: on for pair in _SWITCHES.split(",") for word, on in zip(pair.split(), (1.0, 0.0), strict=True)
}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_WITH_UNIT = re.compile(r"([-+]?\s*[\d.,' ]*\d(?:[eE][-+]?\d+)?)\s*([^\W\d]\S{0,9}|[°%‰\"'][^\d\s]{0,8})")
_LIKE_NUMBER = re.compile(r"[-+]?\s*(\d[\d.,'’\u00a0\u202f ]*|[.,]\d+)([eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}([,.]\d{3})+")
_DOTTED = re.compile(r"\d{1,4}\.\d{1,2}\.\d{1,4}")  # a date: groups of thousands have three digits
_SPACED = re.compile(r"(?<=\d)['’\u00a0\u202f ](?=\d{3}(?!\d))")
_DURATION = re.compile(
    r"(?P<iso>p)?(?:(?P<d>\d+)\s*(?:d|days?|tage?|j)[\s,]*)?(?(iso)t?)"
    r"(?:(?P<h>\d+)\s*(?:h|hrs?|std\.?)\s*)?(?:(?P<m>\d+)\s*(?:m|min)\s*)?(?:(?P<s>\d+(?:[.,]\d+)?)\s*(?:s|sec|sek)?)?",
    re.IGNORECASE,
)
_PARTS = {"d": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0}
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d*([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Numbers:
    """`values` (N,), NaN where nothing was measured; `unit` that stands in the cells, or "".

    `wrong`: index of the first cell that is none of that, or None; `words`: the words of a switch that no
    list knows, the word for 0 first.
    """

    values: Array
    unit: str = ""
    wrong: int | None = None
    words: tuple[str, ...] = ()


def is_empty(cell: str) -> bool:
    """Whether a cell says that nothing was measured."""
    return not cell or cell.casefold() in _NOTHING


def is_switch(cell: str) -> bool:
    """Whether a cell says on or off."""
    return cell.casefold() in SWITCHES


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma, with or without its unit.

    >>> is_number("1.234.567"), is_number("12,5 °C"), is_number("02.03.2026")
    (True, True, False)
    """
    if _DOTTED.fullmatch(cell) or is_duration(cell):
        return False
    return bool(_LIKE_NUMBER.fullmatch(cell)) or bool(
        cell[:1] in "+-.,0123456789" and _WITH_UNIT.fullmatch(cell)
    )


def is_duration(cell: str) -> bool:
    """Whether a cell is a length of time with two parts or more, or one as ISO 8601 writes it.

    >>> is_duration("1m30s"), is_duration("PT30S"), is_duration("30 s"), is_duration("1h")
    (True, True, False, False)
    """
    found = _DURATION.fullmatch(cell) if cell[-1:].isalnum() else None
    if not found:
        return False
    return sum(found[part] is not None for part in _PARTS) > (0 if found["iso"] else 1)


def duration(cell: str) -> float | None:
    """The length of time of a cell [s], None: it is none. A cell of one part needs its unit.

    >>> duration("20h00m30s"), duration("P1DT30S"), duration("45s"), duration("45")
    (72030.0, 86430.0, 45.0, None)
    """
    found = _DURATION.fullmatch(cell)
    if not found or cell.isdecimal() or not cell[-1:].isalnum():
        return None
    parts = {part: found[part].replace(",", ".") for part in _PARTS if found[part]}
    return sum(_PARTS[part] * float(number) for part, number in parts.items()) if parts else None


def is_stamp(cell: str) -> bool:
    """Whether a cell holds a date, a time of day or a length of time.

    >>> is_stamp("2021/06/13-20:05:00"), is_stamp("8:05"), is_stamp("13. Juni 2021"), is_stamp("2021.5")
    (True, True, True, False)
    """
    return is_duration(cell) or bool(
        re.match(
            r"\d{1,4}\s?[-./年]\s?(\d{1,2}|[^\W\d]{3,9}\.?)\s?[-./月 ]\s?\d{1,4}(?!\d)|\d{1,3}[:時h]\d{2}",
            cell,
        )
        or re.match(r"([^\W\d]{2,9}[,.]? )?(\d{1,2}\.? [^\W\d]{3,9}|[^\W\d]{3,9}\.? \d{1,2}),? \d{4}", cell)
    )


def holds_word(cell: str) -> bool:
    """Whether a cell holds neither a number nor a stamp nor a switch nor a word for "not measured"."""
    return not (is_empty(cell) or is_number(cell) or is_switch(cell))


def comma_is_decimal(cells: Iterable[str]) -> bool | None:
    """Whether numbers of a file have a decimal comma (True) or point (False); None where neither is seen."""
    commas = points = 0
    for cell in cells:
        if "," in cell and "." in cell:
            after = cell.rindex(",") > cell.rindex(".")
            commas, points = commas + after, points + (not after)
        elif "," in cell and not _THOUSANDS.fullmatch(cell):
            commas += 1
        elif cell.count(".") == 1 and not _THOUSANDS.fullmatch(cell):
            points += 1
    return None if commas == points else commas > points


def read_numbers(cells: Sequence[str], comma: bool | None) -> Numbers:
    """A column of cells as numbers. `comma`: as of `comma_is_decimal` for the file.

    >>> read_numbers(["1.234,5", "EIN", "-"], comma=True).values.tolist()
    [1234.5, 1.0, nan]
    """
    known: dict[str, float | None] = {}
    units: dict[str, int] = {}
    own = comma if comma is not None else comma_is_decimal(set(cells))
    values = np.empty(len(cells))
    wrong: int | None = None
    strange: dict[str, None] = {}
    for index, cell in enumerate(cells):
        if cell in known:
            value = known[cell]
        else:
            value = known[cell] = _value(cell, own, units)
        if value is None:
            wrong = index if wrong is None else wrong
            strange.setdefault(cell)
            value = math.nan
        values[index] = value
    if wrong is None and (other := _no_switch(known)) is not None:
        wrong = cells.index(other)
        values[[cell == other for cell in cells]] = math.nan
    unit = max(units, key=lambda u: units[u]) if units and sum(units.values()) > len(known) / 2 else ""
    words = [cell for cell in known if cell in strange or cell.casefold() in SWITCHES]
    if wrong is not None and len(words) == 2 and all(map(is_empty, known.keys() - set(words))):
        # one of the two may be known: the word next to "on" is off
        first, second = sorted(words, key=lambda w: (SWITCHES.get(w.casefold(), 0.5), words.index(w)))
        values = np.array([math.nan if is_empty(c) else float(c == second) for c in cells])
        return Numbers(values, "", None, (first, second))
    return Numbers(values, unit, wrong)


def _no_switch(known: Mapping[str, float | None]) -> str | None:
    """The first cell that a switch cannot have: a column that says both on and off knows no other number."""
    said = {SWITCHES[cell.casefold()] for cell in known if cell.casefold() in SWITCHES}
    other = (cell for cell, value in known.items() if value is not None and value not in (0.0, 1.0))
    return next((cell for cell in other if not is_empty(cell)), None) if len(said) == 2 else None


def _value(cell: str, comma: bool | None, units: dict[str, int]) -> float | None:
    """Return one cell as a number. NaN: nothing was measured. None: the cell is no number."""
    if _NUMBER.fullmatch(cell) and not (comma and _THOUSANDS.fullmatch(cell)):
        return _finite(cell)
    folded = unicodedata.normalize("NFKC", cell).strip().replace("−", "-").casefold()
    if is_empty(folded):
        return math.nan
    if folded in SWITCHES:
        return SWITCHES[folded]
    if (value := _spelled(folded, comma)) is not None:
        return value
    found = None if is_duration(folded) else _WITH_UNIT.fullmatch(folded)
    value = _spelled(found[1], comma) if found else None
    if found and value is not None:
        unit = cell.strip()[-len(found[2]) :]
        units[unit] = units.get(unit, 0) + 1
    return value


def _spelled(cell: str, comma: bool | None) -> float | None:
    """A number with a decimal comma, marks of thousands, or blanks behind its sign."""
    if not _LIKE_NUMBER.fullmatch(cell):
        return None
    text = _SPACED.sub("", re.sub(r"^([-+])\s+", r"\1", cell.strip()))
    if "," in text and "." in text:
        mark = "," if text.rindex(",") > text.rindex(".") else "."
        text = text.replace("." if mark == "," else ",", "").replace(",", ".")
    elif _THOUSANDS.fullmatch(text) and ("," not in text or comma is False or text.count(",") > 1):
        text = text.replace(",", "").replace(".", "")
    elif _DECIMAL_COMMA.fullmatch(text):
        text = text.replace(",", ".")
    return _finite(text) if _NUMBER.fullmatch(text) else None


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else math.nan
