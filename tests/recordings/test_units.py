"""Units, against figures from the definitions."""

import math
from typing import Any

import pytest

from discovery.recordings.commonunits import FACTS, SIZE, SPELT, parts
from discovery.recordings.roles import ROLES
from discovery.recordings.units import UnitError, conversion, parse_unit


@pytest.mark.parametrize(
    ("unit", "role", "given", "value", "canonical"),
    [
        ("degF", "ambient temperature", 212.0, 100.0, "degC"),
        ("K", "temperature", 273.15, 0.0, "degC"),
        ("mK", "temperature", 300e3, 26.85, "degC"),
        ("°C", "fluid temperature", 20.0, 20.0, "degC"),
        ("kW", "heat load", 1.2, 1200.0, "W"),
        ("percent", "heat load", 40.0, 40.0, "percent"),
        ("%", "heat load", 40.0, 40.0, "percent"),
        ("%", "fluid flow", 50.0, 0.5, "1"),
        ("m^3/h", "fluid flow", 0.6, 10.0, "l/min"),
        ("kg/s", "fluid flow", 0.5, 30.0, "kg/min"),
        ("1/min", "rotation speed", 600.0, 600.0, "rpm"),
        ("Hz", "rotation speed", 10.0, 600.0, "rpm"),
        ("rad/s", "rotation speed", 2 * math.pi, 60.0, "rpm"),
        ("deg/s", "rotation speed", 360.0, 60.0, "rpm"),
        ("mm", "error", 0.01, 10.0, "um"),
        ("nm", "applied correction", 500.0, 0.5, "um"),
        ("urad", "error", 3.0, 3.0, "um/m"),
        ("mm/m", "error", 0.02, 20.0, "um/m"),
        ("arcsec", "error", 1.0, math.pi / 180 / 3600 * 1e6, "um/m"),
        ("inch", "nozzle height", 2.0, 50.8, "mm"),
        ("bar", "other input", 6.0, 6.0, "bar"),
        ("J/kg/K", "other input", 6.0, 6.0, "J/kg/K"),
        ("K/1/s", "other input", 6.0, 6.0, "K/1/s"),
        ("K**1.25", "other input", 6.0, 6.0, "K**1.25"),
    ],
)
def test_values_become_canonical(unit: str, role: str, given: float, value: float, canonical: str) -> None:
    to = conversion(unit, role)
    assert to.unit == canonical
    assert to.factor * given + to.offset == pytest.approx(value, rel=1e-11, abs=1e-9)


def test_a_difference_takes_the_factor_alone() -> None:
    assert conversion("degF", "temperature").factor == pytest.approx(5 / 9, rel=1e-11)
    assert conversion("K", "temperature").factor == 1.0


@pytest.mark.parametrize(
    ("unit", "role", "said"),
    [
        ("C", "temperature", "did you mean 'degC'?"),
        ("delta_degC", "temperature", "cannot be that"),
        ("A", "heat load", "allowed is W or percent, or what converts to it"),
        ("foo", "other input", "not known"),
        ("", "error", "not known"),
        ("9**9**9**9", "other input", "not known"),
        ("K**9.9**9", "other input", "not known"),
        ("K**99", "other input", "not known"),
        ("__import__('os')", "other input", "not known"),
        ("m" * 1000, "other input", "not known"),
    ],
)
def test_refuses_what_cannot_be(unit: str, role: str, said: str) -> None:
    with pytest.raises(UnitError, match=said.replace("?", r"\?")):
        conversion(unit, role)


def test_canonical_units_are_their_own() -> None:
    for role, facts in ROLES.items():
        for unit in facts.units:
            assert conversion(unit, role).unit == unit
            assert (conversion(unit, role).factor, conversion(unit, role).offset) == (1.0, 0.0)
        for unit in facts.ranges:
            assert conversion(unit, role).unit == unit


def of_pint(unit: str) -> dict[str, float]:
    parsed: Any = parse_unit(unit)
    return {str(name): float(power) for name, power in parsed._units.items()}


@pytest.mark.parametrize("unit", [*SPELT, *(f"{a}/{b}" for a in ("W", "um", "J") for b in ("K", "m", "s"))])
def test_common_units_are_those_of_pint(unit: str) -> None:
    assert parts(unit) == of_pint(unit)


@pytest.mark.parametrize("unit", ["W/m**2/K", "1/min", "s/s", "1*W", "1/1", "K/1/s", "J/kg/K", "W/K**2"])
def test_products_of_common_units_are_those_of_pint(unit: str) -> None:
    assert parts(unit) == of_pint(unit)


@pytest.mark.parametrize("name", FACTS)
def test_common_units_have_the_dimension_and_size_of_pint(name: str) -> None:
    given: Any = parse_unit(f"delta_{name}" if name == "degree_Celsius" else name)
    turns = {"[angle]": 1.0} if name == "revolutions_per_minute" else {}  # pint holds turns for pure numbers
    expected = {str(base): float(n) for base, n in given.dimensionality.items()} | turns
    assert {base: n for base, n in FACTS[name].items() if base != SIZE} == expected
    in_si = (1.0 * given).to_base_units()
    assert FACTS[name][SIZE] == pytest.approx(math.log10(in_si.magnitude), abs=1e-12)


@pytest.mark.parametrize(
    "unit", ["W/degC", "kWh", "", "W K", "W//K", "2*W", "W**1.5", "(W)", "W**10", "/K", "*K", "W*", "W/"]
)
def test_what_is_not_common_is_left_to_pint(unit: str) -> None:
    assert parts(unit) is None


def test_the_unit_of_a_coefficient_of_a_square_is_known() -> None:
    """A search writes it so for the square of a rate."""
    assert parse_unit("1/s/s/(1/s*1/s)") == parse_unit("1/s/s/(s**-2)")
