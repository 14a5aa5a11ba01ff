"""How much decides in a diagnosis: no more than today, on the way to the aim of `benchmarks/rules.py`."""

from __future__ import annotations

from benchmarks.rules import RESOLUTION, SHOWN, TODAY_CONSTANTS, TODAY_RULES, constants, rules


def test_no_rule_and_no_constant_is_added() -> None:
    deciding = [f"{c.file}: {c.name}" for c in constants() if c.decides and not c.made_of]
    assert len(deciding) <= TODAY_CONSTANTS, deciding
    assert len(rules()) <= TODAY_RULES, rules()


def test_what_is_set_apart_is_there() -> None:
    """A name that is listed as deciding nothing, and is gone, would hide the next one of that name."""
    there = {(c.file, c.name) for c in constants()}
    listed = {
        (file, name) for sort in (RESOLUTION, SHOWN) for file, names in sort.items() for name in names.split()
    }
    assert {one for one in listed if one[1] != "*"} - there == set()


def test_every_threshold_says_what_it_means() -> None:
    """A comment beside each, or behind the first line of it."""
    from pathlib import Path

    from discovery.diagnosis import thresholds

    lines = Path(thresholds.__file__).read_text("utf-8").splitlines()
    starts = [k for k, line in enumerate(lines) if line[:1].isupper() and " = " in line]
    for k, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        assert any("#" in line for line in lines[k:end]) or "FACTOR" in lines[k], lines[k]
