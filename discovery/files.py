"""Reading and writing files: one sentence for a mistake, and a file is written whole or not at all."""

import os
import re
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from discovery.errors import UserError
from discovery.limits import read_whole

if TYPE_CHECKING:
    from pydantic import BaseModel

Schema = TypeVar("Schema", bound="BaseModel")
Key = tuple[str | int, ...]  # the way to a value: ("recordings", "fit", "file"); a number counts [[tables]]

_WORD = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')"""
_DOTTED = rf"{_WORD}(?:\s*\.\s*{_WORD})*"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]")
_TABLES = (".csv", ".csv.gz", ".parquet")
_KINDS = {  # the keys that identify a file of each kind, and the command that takes it
    "a campaign": ({"channels", "recordings"}, "check {path}"),
    "an experiment": ({"campaign", "models"}, "run {path}"),
    "a model": ({"states", "terms"}, "check CAMPAIGN --model {path}"),
}
_ASSIGNMENT = re.compile(rf"\s*({_DOTTED})\s*=")


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a UTF-8 file, without byte order mark and with plain line ends.

    Raises UserError: no regular file, too large, not readable, not UTF-8.
    """
    data = read_whole(path)
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise UserError(f"{path}, line {line}: not UTF-8 text; save the file as UTF-8") from None


def read_toml(path: str | os.PathLike[str], schema: type[Schema]) -> Schema:
    """The TOML file at `path` as an instance of the pydantic model `schema`.

    A schema should be frozen and have ``extra="forbid"``, so that a misspelt key is a mistake.
    Raises UserError: one sentence with file, line, key, what is wrong and what is allowed.
    """
    from pydantic import ValidationError

    from discovery.schema import sentences

    text = read_file(path)
    data = parse_toml(text, path)
    check_kind(path, data, schema)
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        key, what = sentences(schema, data, error)[0]
        name = f"{dotted(key)}: " if key else ""
        raise UserError(f"{path}, line {locate(text, key)}: {name}{what}") from None


def read_file(path: str | os.PathLike[str]) -> str:
    """The text of a file to write by hand. Raises UserError as `read_text`, and for a recording."""
    if Path(path).name.lower().endswith(_TABLES) and Path(path).is_file():
        raise UserError(
            f"{path}: this is a recording, and a TOML file is needed; `discovery new DIR --from {path}` "
            "makes campaign, model and experiment of it"
        )
    return read_text(path)


def check_kind(path: str | os.PathLike[str], data: Mapping[str, Any], schema: type["BaseModel"]) -> None:
    """Raises UserError where a file of another kind than that of `schema` was named."""
    of = {kind: schema.model_fields.keys() >= keys for kind, (keys, _) in _KINDS.items()}
    wanted = next((kind for kind, fits in of.items() if fits), "a file of another kind")
    for kind, (keys, command) in _KINDS.items():
        if keys <= data.keys() and not keys & schema.model_fields.keys():
            say = command.format(path=path)
            raise UserError(f"{path}: this is {kind}, and {wanted} is needed; try `discovery {say}`")


def parse_toml(text: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """`text` as TOML; `path` is only named. Raises UserError with line and column."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: of an integer of thousands of digits, too
        what, _, where = str(error).partition(" (at ")
        place = (
            where.rstrip(")") if where.startswith("line") else f"line {text.count(chr(10)) + 1}, at the end"
        )
        raise UserError(f"{path}, {place}: not valid TOML ({what[:1].lower()}{what[1:]})") from None


def dotted(key: Key) -> str:
    """A key as a sentence names it.

    >>> dotted(("terms", 1, "into"))
    'terms[2].into'
    """
    words = [f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in key]
    return "".join(words).lstrip(".")


def locate(text: str, key: Key) -> int:
    """The line, from 1, of the value of `key` in TOML `text`; that of its nearest parent where it is missing.

    >>> locate('name = "x"\\n[models]\\nreduced = { kind = "x" }\\n', ("models", "reduced", "kind"))
    3
    """
    lines = _lines(text)
    return next((lines[key[:depth]] for depth in range(len(key), 0, -1) if key[:depth] in lines), 1)


@lru_cache(maxsize=8)
def _lines(text: str) -> dict[Key, int]:
    """The line in which each key stands first."""
    found: dict[Key, int] = {}
    for line, key in _keys(text):
        found.setdefault(key, line)
    return found


def _keys(text: str) -> Iterator[tuple[int, Key]]:
    """Every key that starts a line of TOML `text`, headers of tables too, with its line."""
    table: Key = ()
    counts: dict[Key, int] = {}
    in_string = False
    for number, line in enumerate(text.splitlines(), start=1):
        quotes = line.count('"""') + line.count("'''")
        if not in_string:
            if header := _HEADER.match(line):
                table = _counted(_words(header[2]), counts, new_item=header[1] == "[[")
                yield number, table
            elif assignment := _ASSIGNMENT.match(line):
                yield number, table + _words(assignment[1])
        in_string ^= quotes % 2 == 1


def _counted(words: Key, counts: dict[Key, int], *, new_item: bool) -> Key:
    """`words` of a header with the number of the array's item behind each name of an array of tables."""
    key: Key = ()
    for position, word in enumerate(words):
        key += (word,)
        if new_item and position == len(words) - 1:
            counts[key] = counts.get(key, -1) + 1
        if key in counts:
            key += (counts[key],)
    return key


def _words(text: str) -> Key:
    """The words of a dotted key, read by the TOML reader itself."""
    try:
        value: Any = tomllib.loads(f"{text} = 0")
    except tomllib.TOMLDecodeError:
        return (text,)
    words: list[str] = []
    while isinstance(value, dict):
        [(word, value)] = value.items()
        words.append(word)
    return tuple(words)


def write_atomic(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write `content` to `path`, whole or not at all; missing folders are made, a text becomes UTF-8.

    Raises UserError when the place cannot be written.
    """
    path = Path(path)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
        temporary = None
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror})") from None
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def write_toml(path: str | os.PathLike[str], data: Mapping[str, Any]) -> None:
    """Write `data` as `format_toml` lays it out. Raises UserError when the place cannot be written."""
    write_atomic(path, format_toml(data))


def format_toml(data: Mapping[str, Any]) -> str:
    """TOML of `data`: plain values first, then a table for each mapping, whose own mappings stand inline.

    A number keeps 12 significant digits, a value None is left out.

    >>> channels = {"T": {"role": "temperature", "noise": 0.1 + 0.2}}
    >>> print(format_toml({"name": "x", "channels": channels}), end="")
    name = "x"
    <BLANKLINE>
    [channels]
    T = { role = "temperature", noise = 0.3 }
    """
    given = {key: value for key, value in data.items() if value is not None}
    tables = {key: value for key, value in given.items() if isinstance(value, Mapping) or _are_tables(value)}
    blocks = [_rows({key: value for key, value in given.items() if key not in tables})]
    for key, value in tables.items():
        if isinstance(value, Mapping):
            blocks.append(f"[{_key(key)}]\n" + _rows(value))
        else:
            blocks.extend(f"[[{_key(key)}]]\n" + _rows(item) for item in value)
    return "\n".join(block for block in blocks if block)


def _are_tables(value: object) -> bool:
    return (
        isinstance(value, list | tuple) and bool(value) and all(isinstance(item, Mapping) for item in value)
    )


def _rows(table: Mapping[str, Any]) -> str:
    names = {_key(key): value for key, value in table.items() if value is not None}
    inline = [name for name, value in names.items() if isinstance(value, Mapping)]
    width = max(map(len, inline), default=0)
    return "".join(
        f"{name:{width if name in inline else 0}} = {_value(value)}\n" for name, value in names.items()
    )


def _value(value: Any) -> str:
    import tomli_w

    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None)
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if hasattr(value, "item"):  # a number of numpy
        value = value.item()
    if isinstance(value, float):
        value = float(f"{value:.12g}")
    return tomli_w.dumps({"x": value}).removeprefix("x = ").removesuffix("\n")


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)
