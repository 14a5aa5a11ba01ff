"""Files: sentences for mistakes, lines of keys, whole files or none."""

import os
import tomllib
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from discovery import files
from discovery.errors import UserError
from discovery.schema import Strict


class Part(Strict):
    kind: Literal["reduced", "sindy"]
    start: float | str = 0.0
    width: float = Field(1.0, gt=0)
    source: str | None = Field(None, alias="from")


class Whole(Strict):
    name: str
    parts: dict[str, Part] = {}
    terms: list[Part] = []


TEXT = """name = "x"

[parts]
one = { kind = "reduced" }
two = { kind = "sindy", width = 2 }

[[terms]]
kind = "sindy"
[[terms]]
kind = "reduced"
start = "T_env"
from = "body"
"""


def read(tmp_path: Path, text: str | bytes) -> Whole:
    path = tmp_path / "x.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return files.read_toml(path, Whole)


def mistake(tmp_path: Path, text: str | bytes) -> str:
    with pytest.raises(UserError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "x.toml"))
    assert "\n" not in message
    return message.removeprefix(str(tmp_path / "x.toml"))


def test_reads_a_good_file(tmp_path: Path) -> None:
    whole = read(tmp_path, "\ufeff" + TEXT.replace("\n", "\r\n"))
    assert whole.parts["two"].width == 2.0
    assert whole.terms[1].start == "T_env"
    assert whole.terms[1].source == "body"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("width", "widht", ", line 5: parts.two.widht: unknown key; did you mean 'width'?"),
        (
            "name =",
            "nmae =",
            ", line 1: nmae: unknown key; did you mean 'name'? Allowed are: name, parts, terms",
        ),
        ('name = "x"', "", ", line 1: the key 'name' is missing"),
        ("sindy", "sindi", ", line 5: parts.two.kind: 'sindi' is not known; did you mean 'sindy'?"),
        ("width = 2", "width = -2", ", line 5: parts.two.width: should be greater than 0, not -2"),
        ('from = "body"', "from = 3", ", line 12: terms[2].from: should be a valid string, not 3"),
        ('"T_env"', "[1]", ", line 11: terms[2].start: should be a valid number, not [1]"),
        ('from = "body"', 'form = "body"', "did you mean 'from'? Allowed are: kind, start, width, from"),
        ('"x"', "x", ", line 1, column 8: not valid TOML (invalid value)"),
        ('"reduced" }', '"reduced"', ", line 4"),
    ],
)
def test_names_line_key_and_what_is_allowed(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert said in mistake(tmp_path, TEXT.replace(old, new, 1) if old != "sindy" else TEXT.replace(old, new))


def test_text_that_is_none(tmp_path: Path) -> None:
    assert "line 2: not UTF-8" in mistake(tmp_path, b'name = "x"\n# \xb0C\n')
    with pytest.raises(UserError, match="no such file"):
        files.read_toml(tmp_path / "none.toml", Whole)
    with pytest.raises(UserError, match="this is a folder"):
        files.read_toml(tmp_path, Whole)


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_in_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"any\.toml"):
        files.read_toml(path, Whole)


@pytest.mark.parametrize(
    ("key", "line"),
    [(("name",), 1), (("parts",), 3), (("parts", "two", "width"), 5), (("terms", 0, "kind"), 8),
     (("terms", 1, "from"), 12), (("terms", 1, "into"), 9), (("nothing",), 1)],
)  # fmt: skip
def test_locates_keys(key: files.Key, line: int) -> None:
    assert files.locate(TEXT, key) == line


def test_locate_reads_quoted_and_dotted_keys_and_skips_text() -> None:
    text = '"a b".c = 1\ntext = """\nname = 2\n"""\nname = 3\n[x."y.z"]\nw = 1\n'
    assert files.locate(text, ("a b", "c")) == 1
    assert files.locate(text, ("name",)) == 5
    assert files.locate(text, ("x", "y.z", "w")) == 7


def test_writes_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "new" / "x.txt"
    files.write_atomic(target, "first ä")
    assert target.read_text(encoding="utf-8") == "first ä"

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fdopen", fail)
    with pytest.raises(UserError, match="cannot be written"):
        files.write_atomic(target, b"second")
    assert target.read_text(encoding="utf-8") == "first ä"
    assert [path.name for path in target.parent.iterdir()] == ["x.txt"]


def test_toml_looks_as_a_person_writes_it() -> None:
    data = {
        "name": "x",
        "parameters": {
            "G": {"start": np.float64(0.1) + 0.2, "unit": "W/K"},
            "long_name": {"start": 1e-7, "min": None},
        },
        "terms": [{"into": "a", "list": [1, 2.0]}, {"into": 'b "c"'}],
        "empty": {},
    }
    assert files.format_toml(data) == (
        'name = "x"\n\n[parameters]\nG         = { start = 0.3, unit = "W/K" }\n'
        "long_name = { start = 1e-07 }\n\n"
        '[[terms]]\ninto = "a"\nlist = [1, 2.0]\n\n[[terms]]\ninto = "b \\"c\\""\n\n[empty]\n'
    )


words = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=4)
plain = st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False) | words
nested = st.recursive(
    plain, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3), max_leaves=8
)


@given(st.dictionaries(words, nested, max_size=4))
def test_what_is_written_is_read_again(data: dict[str, Any]) -> None:
    assert tomllib.loads(files.format_toml(data)) == rounded(data)


def rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.12g}") if isinstance(value, float) else value
