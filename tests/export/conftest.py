"""A small campaign and model that use everything the grammar allows."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

HAS_GCC = shutil.which("gcc") is not None
needs_gcc = pytest.mark.skipif(not HAS_GCC, reason="no C compiler (gcc) is installed")


def make_campaign(hours: float = 12.0, seed: int = 1) -> Campaign:
    """Six inputs every minute, an error every 10 min."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, hours * 3600.0 + 1.0, 60.0)
    n = len(time)
    blocks = np.repeat(rng.integers(0, 5, n // 40 + 1), 40)[:n]
    values = {
        "T_env": 22 + np.sin(time / 9000.0) + rng.normal(0, 0.02, n),
        "T_fluid": 27 + np.cos(time / 7000.0) + rng.normal(0, 0.02, n),
        "pump": (blocks > 1).astype(float),
        "speed": blocks * 300.0,
        "P_drive": blocks * 180.0,
    }
    error = np.full(n, np.nan)
    error[::10] = rng.normal(0, 1, len(error[::10]))
    channels = {
        "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
        "T_fluid": Channel("T_fluid", "fluid temperature", "degC", None, "linear"),
        "pump": Channel("pump", "fluid flow", "1", None, "held"),
        "speed": Channel("speed", "rotation speed", "rpm", None, "held"),
        "P_drive": Channel("P_drive", "heat load", "W", None, "held"),
        "E_Z0T": Channel("E_Z0T", "error", "um", 0.5, "held"),
        "E_A0C": Channel("E_A0C", "error", "um/m", 1.4, "held"),
    }
    values |= {"E_Z0T": error, "E_A0C": error}
    return Campaign("small", channels, {"fit": Recording("fit", time, values)}, Path("campaign.toml"))


def make_model() -> Model:
    """Two bodies with gate, power, delay, lag, play, where, radiation and a hidden mass."""
    numbers = {"G": 24.0, "hA": 4.0, "m": 0.3, "tau": 3000.0, "late": 65.0, "width": 0.3}
    states = {
        "a": State("a", "degC", 44.7e3, parse("T_env"), 0.5, 1 / 44.7e3),
        "b": State("b", "degC", 62e3, parse("T_env + 0.5"), 0.5, 1 / 62e3),
    }
    terms = (
        Term("conduction", "a", parse("G*(b - a)"), "b"),
        Term("air", "b", parse("hA*abs(T_env - b)**1.25*sign(T_env - b)")),
        Term("fluid", "a", parse("pump*where(speed > 0, 50*(speed/600)**m, 20)*(delay(T_fluid, late) - a)")),
        Term("drive", "b", parse("0.5*lag(P_drive, tau) + 10*tanh(P_drive/500)")),
        Term("radiation", "b", parse("5.67e-8*((T_env + 273.15)**4 - (b + 273.15)**4)")),
        Term("joint", "a", parse("3*play(b - 22, width)")),
    )
    outputs = {
        "E_Z0T": parse("1.92*(a - 22) + 3*play(b - 22, 0.2)"),
        "E_A0C": parse("max(min(4*(a - b), 30), -30)"),
    }
    return Model(
        "Everything: ä */ model", {k: Parameter(v) for k, v in numbers.items()}, states, terms, outputs
    )


@pytest.fixture(scope="session")
def campaign() -> Campaign:
    return make_campaign()


@pytest.fixture
def model() -> Model:
    return make_model()
