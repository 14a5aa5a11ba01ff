"""Systems that swing by themselves, as no body that only loses heat does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import discovery
from discovery.errors import UserError
from discovery.frames import campaign_from_frames
from discovery.models.model import TIME_UNITS
from discovery.sparse.discover import discover
from discovery.sparse.discovery import Discovery
from discovery.sparse.options import SparseOptions
from discovery.terms import names, text

Array = NDArray[np.floating]
State = list[float]


def recorded(
    rates: Callable[[float, Any], State], begin: State, time: Array, noise: float, columns: list[str]
) -> pd.DataFrame:
    """The first states of a system as readings with noise."""
    path = solve_ivp(rates, (0.0, time[-1]), begin, t_eval=time, rtol=1e-9, atol=1e-9).y.T[:, : len(columns)]
    rng = np.random.default_rng(len(columns))
    return pd.DataFrame(path + noise * rng.standard_normal(path.shape), index=time, columns=columns)


def laws(found: Discovery) -> dict[str, float]:
    """Coefficients per second by term and state."""
    second = TIME_UNITS[found.model.time_unit]
    out = {}
    for term in found.model.terms:
        for name in names(term.expression) & set(found.model.parameters):
            out[f"{term.into}: {text(term.expression)}"] = found.model.parameters[name].value / second
    return out


def van_der_pol(_: float, z: State) -> State:
    return [z[1], 1.5 * (1 - z[0] ** 2) * z[1] - z[0]]


def fitz_hugh(_: float, z: State) -> State:
    return [z[0] - z[0] ** 3 / 3 - z[1] + 0.5, 0.08 * (z[0] + 0.7 - 0.8 * z[1])]


def hares(_: float, z: State) -> State:
    return [1.1 * z[0] - 0.4 * z[0] * z[1], 0.1 * z[0] * z[1] - 0.4 * z[1]]


OTHER = {"role": "other output", "unit": "1"}


def swings() -> dict[str, pd.DataFrame]:
    time = 0.05 * np.arange(800)
    return {
        "a": recorded(van_der_pol, [0.5, 0.0], time, 0.01, ["x"]),
        "b": recorded(van_der_pol, [2.5, -1.0], time, 0.01, ["x"]),
    }


def test_a_limit_cycle_is_found_as_its_own_law() -> None:
    options = SparseOptions(library=("linear", "cubic", "y**2*rate"), bootstraps=0)
    found = discover(campaign_from_frames(swings(), {"x": OTHER}), ["a", "b"], ["x"], options)
    assert list(found.report["groups"][0]["kept"]) == ["x_rate: x", "x_rate: x_rate", "x_rate: x**2*x_rate"]
    values = [found.model.parameters[n].value for n in ("x_rate_p2", "x_rate_p4", "x_rate_p6")]
    np.testing.assert_allclose(values, [-1.0, 1.5, -1.5], rtol=0.02)


def test_short_steps_do_not_bend_the_law() -> None:
    """Steps as long as between the readings would bend this coefficient by 1 %."""
    time = 0.4 * np.arange(300)
    frames = {
        "a": recorded(fitz_hugh, [0.5, 0.0], time, 0.02, ["v", "w"]),
        "b": recorded(fitz_hugh, [-1.0, 1.2], time, 0.02, ["v", "w"]),
    }
    channels = {"v": OTHER, "w": OTHER}
    words = ("linear", "cubic", "drag", "coupling")
    options = SparseOptions(hidden="own", library=words, bootstraps=0)
    found = discover(campaign_from_frames(frames, channels), ["a", "b"], ["v", "w"], options)
    kept = found.report["groups"][0]["kept"]
    assert sorted(kept) == ["v: 1", "v: v", "v: v**3", "v: w", "w: 1", "w: v", "w: w"]
    of = {term.split("*", 1)[-1]: value for term, value in laws(found).items() if term.startswith("v: ")}
    assert of["v**3"] == pytest.approx(-1 / 3, rel=0.005)


def hare_and_lynx() -> dict[str, pd.DataFrame]:
    time = 0.1 * np.arange(600)
    return {
        "a": recorded(hares, [10.0, 5.0], time, 0.05, ["hare", "lynx"]),
        "b": recorded(hares, [6.0, 4.0], time, 0.05, ["hare", "lynx"]),
    }


def test_products_of_outputs_make_them_one_system() -> None:
    campaign = campaign_from_frames(hare_and_lynx(), {"hare": OTHER, "lynx": OTHER})
    options = SparseOptions(library=("linear", "product"), bootstraps=0)
    found = discover(campaign, ["a", "b"], ["hare", "lynx"], options)
    values = sorted(laws(found).values())
    np.testing.assert_allclose(values, [-0.4, -0.4, 0.1, 1.1], rtol=0.02)


def test_a_line_that_holds_the_law_back_is_named() -> None:
    """A swing that grows from rest, which no law of a stable system has."""
    options = SparseOptions(
        library=("linear", "cubic", "y**2*rate"), hidden="rate", stable=True, bootstraps=0
    )
    with pytest.raises(UserError, match="'stable = true' limits the coefficient of 'x_rate'"):
        discover(campaign_from_frames(swings(), {"x": OTHER}), ["a", "b"], ["x"], options)


def warmed(seed: int) -> pd.DataFrame:
    """An error [um] that falls by 0.02 um/W of a heat load, and follows the air."""
    rng, step = np.random.default_rng(seed), 60.0
    load = np.repeat(rng.choice([0.0, 200.0, 400.0], 30), 30)
    time = step * np.arange(len(load))
    air = 22 + 2 * np.sin(2 * np.pi * time / 86400 + rng.uniform(0, 6))
    first, then, read = 0.0, 0.0, []
    for p, t in zip(load, air, strict=True):
        read.append(first + then)
        first += step * (-0.02 * p - first) / 3600
        then += step * (0.8 * (t - 20) - then) / 7200
    error = np.array(read) + 0.3 * rng.standard_normal(len(read))
    return pd.DataFrame({"P": load, "T": air, "E": error}, index=time)


@pytest.mark.parametrize(("bounds", "told"), [({"P": (0.0, np.inf)}, True), ({"P": (-0.05, 0.0)}, False)])
def test_a_bound_of_a_gain_that_binds_is_named(bounds: dict[str, tuple[float, float]], told: bool) -> None:
    channels = {
        "P": {"role": "heat load", "unit": "W"},
        "T": {"role": "ambient temperature", "unit": "degC"},
        "E": {"role": "error", "unit": "um"},
    }
    campaign = campaign_from_frames({"a": warmed(0), "b": warmed(1)}, channels)
    found = discover(campaign, ["a", "b"], ["E"], SparseOptions(bounds=bounds, bootstraps=0))
    assert any("'bounds' limits the coefficient of 'P'" in said for said in found.report["binding"]) == told


def test_an_expression_of_an_unknown_name_is_refused() -> None:
    campaign = campaign_from_frames(hare_and_lynx(), {"hare": OTHER, "lynx": OTHER})
    options = SparseOptions(form="rates", library=("linear", "hair*lynx"), bootstraps=0)
    with pytest.raises(UserError, match="names 'hair' in 'hair\\*lynx'"):
        discover(campaign, ["a"], ["hare", "lynx"], options)


@pytest.mark.parametrize("form", ["auto", "rates"])
def test_a_bound_of_an_unknown_term_is_named(form: str) -> None:
    campaign = campaign_from_frames(hare_and_lynx(), {"hare": OTHER, "lynx": OTHER})
    options = SparseOptions.model_validate({"form": form, "library": ["linear"], "bounds": {"hair": [0, 1]}})
    with pytest.raises(UserError, match="has 'hair' under bounds, which is not a term of its library"):
        discover(campaign, ["a"], ["hare", "lynx"], options)


def test_a_summary_names_bounds_that_bind() -> None:
    channels = {"u": {"role": "other input", "unit": "V"}, "y": {"role": "other output", "unit": "cm"}}
    u = np.repeat(np.random.default_rng(3).uniform(0.0, 2.0, 20), 20)
    level, read = 1.0, []
    for pump in u:
        read.append(level)
        level = pump * 1.5 + (level - pump * 1.5) * np.exp(-0.2)
    noise = 0.005 * np.random.default_rng(4).standard_normal(len(u))
    frame = pd.DataFrame({"u": u, "y": np.array(read) + noise}, index=1.0 * np.arange(len(u)))
    options = {"form": "rates", "hidden": "own", "library": ["linear"]}
    assert "Bounds that bind" not in discovery.discover({"a": frame}, ["y"], channels, **options).summary()
    tight = discovery.discover({"a": frame}, ["y"], channels, bounds={"u": (0.0, 0.1)}, **options).summary()
    assert "Bounds that bind\n  y: 'bounds' limits the coefficient of 'u'" in tight
