"""Text of an unknown encoding: the one in which its letters make words.

Detectors that know languages by the frequencies of their letters need sentences; a logger writes ten words of
header, so that the words of the vocabulary say more.
"""

from __future__ import annotations

import codecs
import re
import unicodedata
from pathlib import Path

from discovery.errors import UserError
from discovery.firsthour.vocabulary import words_of

# most frequent first: of two that read a text equally well, the first is taken
_ENCODINGS = (
    "cp1252",
    "cp932",
    "euc_jp",
    "gb18030",
    "cp949",
    "big5",
    "cp1250",
    "cp1251",
    "cp437",
    "mac_roman",
)
_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_SIGNS = set("°℃℉µμ±²³·ΔΩ×‰")
_SAMPLE = 65536  # bytes
# no word has a sign, or letters of East Asia, between two letters
_INSIDE = re.compile(r"[^\W\d_][²³¹¼½¾¿¡¬¦§¨´¸¯][^\W\d_]|[a-z][\u3040-\u9fff\uac00-\ud7af]+[a-z]")
_MIXED = re.compile(r"[a-z][\u0400-\u04ff]|[\u0400-\u04ff][a-z]", re.IGNORECASE)  # no word has both alphabets
_WORD, _LETTER, _SIGN, _ODD = 6.0, 0.5, 1.0, -4.0


def decode(data: bytes, path: Path) -> tuple[str, tuple[str, ...]]:
    """The text, and a note where its encoding had to be guessed.

    Raises:
        UserError: no text.
    """
    for mark, name in _MARKS:
        if data.startswith(mark):
            return data.decode(name, errors="replace"), ()
    if wide := _without_mark(data[:_SAMPLE]):
        return data.decode(wide, errors="replace"), ()
    if b"\0" in data:
        raise UserError(f"{path}: this is no text; save the table as CSV or .xlsx")
    try:
        return data.decode("utf-8"), ()
    except UnicodeDecodeError:
        pass
    odd = (
        b"\n".join(line for line in data[:_SAMPLE].splitlines()[:-1] if not line.isascii()) or data[:_SAMPLE]
    )
    best = max(_ENCODINGS, key=lambda name: _likely(odd, name))
    return data.decode(best, errors="replace"), (f"text read as {_CALLED.get(best, best)}",)


_CALLED = {
    "cp1252": "Windows-1252",
    "cp1250": "Windows-1250",
    "cp1251": "Windows-1251",
    "cp932": "Shift-JIS",
    "euc_jp": "EUC-JP",
    "gb18030": "GB 18030",
}


def _without_mark(data: bytes) -> str:
    """UTF-16 without a byte order mark, or "": every other byte of most of its characters is zero."""
    half = max(1, len(data) // 2)
    if data[1::2].count(0) > 0.4 * half and data[0::2].count(0) < 0.05 * half:
        return "utf-16-le"
    if data[0::2].count(0) > 0.4 * half and data[1::2].count(0) < 0.05 * half:
        return "utf-16-be"
    return ""


def _likely(data: bytes, encoding: str) -> float:
    """Return how much the text looks like words if it is read in this encoding."""
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        return float("-inf")
    found = sum(not word.said.isascii() or len(word.said) > 2 for word in words_of(text[:2000]))
    letters = sum(map(_letter, filter(lambda c: not c.isascii(), text)))
    return _WORD * found + letters + _ODD * (len(_MIXED.findall(text)) + len(_INSIDE.findall(text)))


def _letter(char: str) -> float:
    if char in _SIGNS:
        return _SIGN
    name = unicodedata.name(char, "")
    if "HALFWIDTH" in name or not name or unicodedata.category(char) in ("Sm", "Sk", "So", "Cc", "Co"):
        return _ODD
    if name.startswith(("HIRAGANA", "KATAKANA", "CJK", "HANGUL", "FULLWIDTH")):
        return _LETTER / 2  # two bytes make one
    if name.startswith(("LATIN SMALL", "CYRILLIC SMALL")):
        if char in "ąćęłńśźżčďěňřšťůžőű":
            return 0.0
        return _LETTER if char in "äöüßéèêàçñóíáúâîôûåæøãõ" or name.startswith("CYR") else -1.0
    return 0.0
