"""Equations (1) to (6) against numbers computed by hand from the paper."""

import math
import warnings

import numpy as np
import pytest

from discovery.models.convection import (
    OutsideValidity,
    biot_number,
    ekman,
    film_coefficient,
    jet_velocity,
    nusselt,
    prandtl_number,
    rad_per_s,
    speed_new,
    validity,
)

# speed, Reynolds number -> h at 50 and 100 mm; d_n 10 mm, lambda_s 45, lambda_f 0.58, nu 1.2e-6, r_d 0.25 m
TABLE = {
    (100, 500): (1414, 1506),
    (100, 1000): (2378, 2533),
    (100, 1500): (3223, 3433),
    (600, 500): (1725, 1838),
    (600, 1000): (2902, 3091),
    (600, 1500): (3933, 4189),
    (750, 500): (1769, 1884),
    (750, 1000): (2975, 3168),
    (750, 1500): (4032, 4294),
    (1200, 500): (1864, 1985),
    (1200, 1000): (3134, 3338),
    (1200, 1500): (4248, 4524),
}


def quiet(rpm: float, h_n: float, reynolds: float, **others: object) -> float:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OutsideValidity)
        return film_coefficient(rpm, h_n, reynolds, **others)  # type: ignore[arg-type]


@pytest.mark.parametrize(("speed", "reynolds"), TABLE)
def test_film_coefficients(speed: int, reynolds: int) -> None:
    for h_n, expected in zip((0.05, 0.10), TABLE[speed, reynolds], strict=True):
        assert quiet(speed, h_n, reynolds) == pytest.approx(expected, abs=1.0)


def test_ten_litres_a_minute() -> None:
    """Re = 4 Q/(pi d_n nu) of 10 l/min from a nozzle of 10 mm, and its h at 600 rpm."""
    reynolds = 4 * (10e-3 / 60) / (math.pi * 0.010 * 1.2e-6)
    assert reynolds == pytest.approx(17_684, abs=1)
    assert quiet(600, 0.05, reynolds) == pytest.approx(25_024, rel=1e-3)


@pytest.mark.parametrize(
    ("speed", "printed", "gentle"),
    [(751, 1.001, 1.001), (760, 2.01, 1.017), (800, 4.91, 1.13), (1000, 12.0, 1.41), (1200, 16.6, 1.55)],
)
def test_equation_6(speed: float, printed: float, gentle: float) -> None:
    """h(n)/h(750) = (Omega_new/750)^0.1111."""
    base = quiet(750, 0.05, 1000)
    assert quiet(speed, 0.05, 1000, variant="printed") / base == pytest.approx(printed, rel=5e-3)
    assert quiet(speed, 0.05, 1000, variant="1.5") / base == pytest.approx(gentle, rel=5e-3)
    assert speed_new(speed) == speed
    assert speed_new(750, "printed") == 750


def test_the_printed_limits_belong_to_a_disk_of_six_millimetres() -> None:
    assert ekman(5.0e-7, rad_per_s(750), 6.001e-3) == pytest.approx(4.42e-5, rel=2e-3)
    # ... and on the table of the machine the limit is reached at 1.04 rpm
    assert ekman(1.2e-6, rad_per_s(1.04), 0.25) == pytest.approx(4.42e-5, rel=5e-3)


def test_standstill_has_a_floor() -> None:
    assert nusselt(5.0, 1000.0, ekman(1.2e-6, 0.0, 0.25), 77.6) == 0.0
    assert quiet(0, 0.05, 1000) == 0.0
    assert film_coefficient(0, 0.05, 1000, floor=400.0) == 400.0
    with pytest.warns(OutsideValidity, match="standstill"):
        film_coefficient(0, 0.05, 1000)


def test_what_leaves_the_ranges_warns() -> None:
    with pytest.warns(OutsideValidity, match="Ekman number"):
        film_coefficient(600, 0.05, 1000)
    with pytest.warns(OutsideValidity, match="Reynolds number 2e"):
        film_coefficient(1, 0.05, 2e4)
    assert validity(1e-3, 1000, 100, prandtl=7.0, biot=0.01) == []
    sentences = validity(1e-3, 1000, 900, prandtl=200.0, biot=3.3)
    assert [s.split(" ")[0] for s in sentences] == ["Prandtl", "Biot", "speed"]
    assert validity(1e-3, 1000, 900, variant="printed") == []


def test_a_slower_table_on_a_small_disk_is_inside() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = film_coefficient(500, 0.003, 1000, d_n=0.0012, r_d=0.006, nu_f=1e-6, prandtl=7.0)
    assert found > 0


def test_the_law_in_the_model_is_the_law_of_the_functions() -> None:
    from discovery.models.thermobalance import film, thermobalance
    from discovery.terms import evaluate, parse

    for variant in ("none", "printed", "1.5"):
        model = thermobalance(variant=variant)
        values = {name: p.value for name, p in model.parameters.items()} | {"h_nozzle": 100.0}
        for speed in (0.0, 100.0, 600.0, 751.0, 1200.0):
            found = evaluate(parse(film(variant)), values | {"speed": speed}).value
            expected = quiet(
                speed, 0.10, 1000, variant=variant, floor=values["h_still"] if speed == 0 else 0.0
            )
            assert float(np.asarray(found)) == pytest.approx(expected, rel=1e-5)


def test_jet_prandtl_and_biot_by_hand() -> None:
    """10 l/min through 10 mm: 1.667e-4 m3/s / 7.854e-5 m2 = 2.122 m/s, Re = 2.122 x 0.01/1.2e-6 = 17684.
    Pr = 1.2e-6 x 4.15e6/0.58 = 8.586. Bi = 3000 x 0.06/45 = 4.
    """
    assert jet_velocity(10.0, 0.010) == pytest.approx(2.1221, rel=1e-4)
    assert jet_velocity(10.0, 0.010) * 0.010 / 1.2e-6 == pytest.approx(17684, rel=1e-4)
    assert prandtl_number(1.2e-6, 0.58) == pytest.approx(8.586, rel=1e-3)
    assert biot_number(3000.0, 0.06, 45.0) == pytest.approx(4.0)


def test_the_jet_in_the_model_by_hand() -> None:
    """With b = 0.0909, m = 0.75 the free exponents are eq. (1) at the Reynolds number of the flow. At rest
    h_still (100/50)^b (5/10)^m: 400 x 1.0650 x 0.5946 = 253.3.
    """
    from discovery.models.thermobalance import film, thermobalance
    from discovery.terms import evaluate, parse

    values = {name: p.value for name, p in thermobalance(jet=True).parameters.items()}
    here = values | {"h_nozzle": 100.0, "flow": 5.0}
    law = parse(film(jet=True))
    reynolds = jet_velocity(5.0, 0.010) * 0.010 / 1.2e-6
    for speed in (100.0, 600.0):
        found = float(np.asarray(evaluate(law, here | {"speed": speed}).value))
        assert found == pytest.approx(quiet(speed, 0.10, reynolds), rel=1e-5)
    still = float(np.asarray(evaluate(law, here | {"speed": 0.0}).value))
    assert still == pytest.approx(253.3, rel=1e-3)


def test_a_model_outside_the_ranges_says_so_once() -> None:
    from discovery.models.convection import validity_of_model
    from discovery.models.thermobalance import thermobalance
    from discovery.recordings import Campaign, Channel, Recording

    time = np.array([0.0, 60.0])
    channels = {
        "speed": Channel("speed", "rotation speed", "rpm", None, "held"),
        "h_nozzle": Channel("h_nozzle", "nozzle height", "mm", None, "held"),
        "pump": Channel("pump", "fluid flow", "1", None, "held"),
    }
    values = {"speed": np.array([100.0, 900.0]), "h_nozzle": np.full(2, 50.0), "pump": np.ones(2)}
    campaign = Campaign("c", channels, {"r": Recording("r", time, values)})
    (note,) = validity_of_model(thermobalance(), campaign, ["r"])
    for what in ("Ekman", "Biot", "speed in rpm 900"):
        assert what in note
    assert "Prandtl" not in note  # 8.6 is inside
    assert "Reynolds" not in note  # 1000 is inside
    (with_6,) = validity_of_model(thermobalance(variant="printed"), campaign, ["r"])
    assert "speed in rpm" not in with_6  # eq. (6) reaches 1200 rpm
    assert validity_of_model(thermobalance(fluid=False), campaign, ["r"]) == []
