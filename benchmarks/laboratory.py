"""Laboratory machines that are read fast and precisely: python -m benchmarks.laboratory FOLDER [--seed N]

Writes a case for each machine and kind into FOLDER, with `keys.json`.
`discovery challenge --cases-from FOLDER --no-baselines` then solves and scores them. The machines are
integrated here in steps of 1 s, without the package. `late` cases stamp the mean of an interval at its end.
Hand-built models are right but for the effect.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = Mapping[str, float]
Inputs = dict[str, Array]
Rates = Callable[[Array, Values, bool], Sequence[float]]
AMBIENT, HEAT, OTHER = "ambient temperature", "heat load", "other input"
BOLTZMANN, ZERO = 5.67e-8, 273.15


def steps(rng: np.random.Generator, count: int, low: float, high: float, mean: float, rest: float) -> Array:
    """Levels (N,) between `low` and `high` for about `mean` s each, a share `rest` of them zero."""
    out, i = np.zeros(count), 0
    while i < count:
        lasting = int(rng.exponential(mean) + 0.3 * mean)
        out[i : i + lasting] = 0.0 if rng.random() < rest else rng.uniform(low, high)
        i += lasting
    return out


def room(rng: np.random.Generator, count: int) -> Array:
    """A room (N,) in degC that is heated now and then."""
    time = np.arange(count)
    wave = 0.8 * np.sin(2 * np.pi * time / 7200 + rng.uniform(0, 6))
    return np.asarray(21 + rng.normal() + wave + 0.3 * np.cumsum(rng.normal(size=count)) / np.sqrt(count))


def lagged(series: Array, tau: float) -> Array:
    """First-order response (N,) that begins settled."""
    out, now = np.empty_like(series), float(series[0])
    for k, value in enumerate(series):
        out[k] = now
        now += (value - now) / tau
    return out


@dataclass(frozen=True)
class Machine:
    """A machine, its hand-built model, and what that lacks where the effect acts.

    `drives`: by held input its role, unit, lowest and highest level, mean length in s and share at rest.
    `rates`: of the states [K/s]. `outputs`: by name its noise and what it shows of states (N, n) and inputs.
    `parameters` and `terms` are lines of the model; `states` have capacities in J/K.
    """

    drives: Mapping[str, tuple[str, str, float, float, float, float]]
    rates: Rates
    outputs: Mapping[str, tuple[float, Callable[[Array, Inputs, bool], Array]]]
    states: Mapping[str, float]
    parameters: str
    terms: Sequence[tuple[str, str, str]]  # into, from, expression
    key: Mapping[str, Any]
    every: int = 15
    hours: int = 6
    hidden: int = 0  # states that the hand-built model does not have
    errors: Mapping[str, str] = field(default_factory=dict)  # output -> expression of the model
    changed: Callable[[np.random.Generator, str, Inputs, Inputs, bool], None] = lambda *_: None

    def model(self, name: str) -> str:
        """The text of the hand-built model."""
        capacities = "".join(
            f'{s} = {{ unit = "degC", capacity = {c}, start = "T_amb" }}\n' for s, c in self.states.items()
        )
        terms = "".join(
            f'[[terms]]\ninto = "{into}"\n'
            + (f'from = "{source}"\n' if source else "")
            + f'expression = "{law}"\n'
            for into, source, law in self.terms
        )
        shown = "".join(f'{y} = "{law}"\n' for y, law in self.errors.items())
        shown = f"[outputs]\n{shown}" if shown else ""
        return f'name = "{name}"\n[parameters]\n{self.parameters}[states]\n{capacities}{terms}{shown}'


def free(name: str, start: float, unit: str) -> str:
    """A line of a positive parameter."""
    return f'{name} = {{ start = {start}, unit = "{unit}", min = 0.0 }}\n'


def state(k: int) -> Callable[[Array, Inputs, bool], Array]:
    """An output that shows a state as it is."""
    return lambda x, _u, _acts: x[:, k]


def heated(capacity: float, loss: float) -> Rates:
    """One body that the power P heats and the air cools."""
    return lambda x, u, _: [(u["P"] - loss * (x[0] - u["T_amb"])) / capacity]


def plate(rates: Rates | None = None, key: Mapping[str, Any] | None = None, **more: Any) -> Machine:
    """A plate that a recorded power heats."""
    given: dict[str, Any] = {
        "drives": {"P": (HEAT, "W", 20.0, 150.0, 1100.0, 0.25)},
        "outputs": {"T_b": (0.1, state(0))},
        "states": {"T_b": 1200.0},
        "parameters": free("hA", 1.0, "W/K") + free("g", 1.0, "1"),
        "terms": [("T_b", "", "g*P"), ("T_b", "", "hA*(T_amb - T_b)")],
    }
    nothing: dict[str, Any] = {"effect": None, "states": []}
    return Machine(rates=rates or heated(1200.0, 1.4), key=key or nothing, **(given | more))


def _motor(x: Array, u: Values, acts: bool) -> Sequence[float]:
    link, loss = 2.5 * (x[0] - x[1]), 1.1 * (1 + 0.9 * u["fan"] * acts) * (x[1] - u["T_amb"])
    return [(u["P"] - link) / 420.0, (link - loss) / 2600.0]


def _barrel(x: Array, u: Values, acts: bool) -> Sequence[float]:
    one, two = 6.0 * (x[0] - x[1]), 5.0 * acts * (x[1] - x[2])
    a, b, c = (h * (t - u["T_amb"]) for h, t in zip((3.0, 2.6, 3.2), x, strict=True))
    return [(u["P1"] - one - a) / 1800.0, (u["P2"] + one - two - b) / 1500.0, (u["P3"] + two - c) / 1700.0]


def _oven(x: Array, u: Values, acts: bool) -> Sequence[float]:
    load, wall = 4.0 * (x[0] - x[1]), 6.0 * acts * (x[0] - x[2])
    return [(u["P"] - load - wall - 5.0 * (x[0] - u["T_amb"])) / 1500.0, load / 2500.0, wall / 9000.0]


def _spindle(x: Array, u: Values, _: bool) -> Sequence[float]:
    link, room_ = 9.0 * (x[0] - x[1]), u["T_amb"]
    friction = 260.0 * (u["speed"] / 10000.0) ** 1.5
    return [(friction - link - 1.5 * (x[0] - room_)) / 2200.0, (link - 6.0 * (x[1] - room_)) / 12000.0]


def _diode(x: Array, u: Values, acts: bool) -> Sequence[float]:
    rays = 0.036 * acts * BOLTZMANN * ((x[0] + ZERO) ** 4 - (u["T_amb"] + ZERO) ** 4)
    link = 1.5 * (x[0] - x[1])
    air = 0.25 * (x[0] - u["T_amb"]), 2.2 * (x[1] - u["T_amb"])
    return [(u["P"] - link - rays - air[0]) / 260.0, (link - air[1]) / 1500.0]


def _kiln(x: Array, u: Values, acts: bool) -> Sequence[float]:
    rays = 0.064 * BOLTZMANN * ((x[0] + ZERO) ** 4 - (u["T_amb"] + ZERO) ** 4)
    loss = 1.2 * (x[0] - u["T_amb"]) + (rays if acts else 2.0 * (x[0] - u["T_amb"]))
    return [(u["P"] - loss) / 4000.0]


def _evaporating(x: Array, u: Values, acts: bool) -> Sequence[float]:
    vapour = 0.25 * acts * (np.exp(0.06 * x[0]) - np.exp(0.06 * u["T_amb"]))
    return [(u["P"] - 2.0 * (x[0] - u["T_amb"]) - vapour) / 1200.0]


def _board(x: Array, u: Values, acts: bool) -> Sequence[float]:
    links = [0.4 * acts * (t - x[2]) for t in x[:2]]
    chips = [
        (u[p] - 0.5 * (t - u["T_amb"]) - q) / c
        for p, t, q, c in zip(("P1", "P2"), x[:2], links, (60.0, 70.0), strict=True)
    ]
    return [*chips, (sum(links) - acts * (x[2] - u["T_amb"])) / 900.0]


def _soaking(x: Array, u: Values, acts: bool) -> Sequence[float]:
    soaked = 2.0 * acts * (x[0] - x[1])
    return [(u["P"] - 1.0 * (x[0] - u["T_amb"]) - soaked) / 1200.0, soaked / 3000.0]


def _jump(_: np.random.Generator, run: str, __: Inputs, shown: Inputs, acts: bool) -> None:
    if acts and run == "a":
        shown["T_b"][int(0.6 * len(shown["T_b"])) :] += 3.0


def _noisy(rng: np.random.Generator, _: str, inputs: Inputs, __: Inputs, acts: bool) -> None:
    count = len(inputs["P"])
    if acts:
        inputs["P"] = inputs["P"] * np.repeat(rng.normal(1.0, 0.1, count // 15 + 1), 15)[:count]


def _ohm(name: str, into: str) -> tuple[str, str, str]:
    return into, "", f"h{name}*(T_amb - {into})"


def _of(effect: str, *states: str, also: Sequence[str] = (), **more: Any) -> dict[str, Any]:
    return {"effect": effect, "states": list(states), "also": list(also), **more}


MACHINES: dict[str, Machine] = {
    "motor": Machine(
        {"P": (HEAT, "W", 20, 120, 900, 0.25), "fan": (OTHER, "1", 1, 1, 1500, 0.5)},
        _motor,
        {"T_w": (0.1, state(0)), "T_h": (0.1, state(1))},
        {"T_w": 420.0, "T_h": 2600.0},
        free("G", 2.0, "W/K") + free("hA", 1.0, "W/K"),
        [("T_w", "", "P"), ("T_h", "T_w", "G*(T_w - T_h)"), ("T_h", "", "hA*(T_amb - T_h)")],
        _of("input_exchange", "T_h"),
        every=10,
    ),
    "barrel": Machine(
        {f"P{k}": (HEAT, "W", 50, 400, 900, 0.25) for k in (1, 2, 3)},
        _barrel,
        {f"Z{k}": (0.15, state(k - 1)) for k in (1, 2, 3)},
        {"Z1": 1800.0, "Z2": 1500.0, "Z3": 1700.0},
        free("G", 5.0, "W/K") + "".join(free(f"h{k}", 3.0, "W/K") for k in (1, 2, 3)),
        [
            *((f"Z{k}", "", f"P{k}") for k in (1, 2, 3)),
            *(_ohm(str(k), f"Z{k}") for k in (1, 2, 3)),
            ("Z2", "Z1", "G*(Z1 - Z2)"),
        ],
        _of("conduction_path", "Z2", "Z3", also=["contact_conductance"]),
    ),
    "cell": Machine(
        {"current": (OTHER, "A", 2, 12, 700, 0.25)},
        lambda x, u, _: [(0.035 * u["current"] ** 2 - 0.25 * (x[0] - u["T_amb"])) / 75.0],
        {"T_cell": (0.05, lambda x, _, acts: lagged(x[:, 0], 60.0) if acts else x[:, 0])},
        {"T_cell": 75.0},
        free("R", 0.03, "1") + free("hA", 0.3, "W/K"),
        [("T_cell", "", "R*current**2"), ("T_cell", "", "hA*(T_amb - T_cell)")],
        _of("sensor_lag", "T_cell", also=["second_thermal_mass"]),
        every=10,
    ),
    "oven": Machine(
        {"P": (HEAT, "W", 200, 900, 1200, 0.25)},
        _oven,
        {"T_air": (0.2, state(0)), "T_load": (0.1, state(1))},
        {"T_air": 1500.0, "T_load": 2500.0},
        free("G", 3.0, "W/K") + free("hA", 5.0, "W/K"),
        [
            ("T_air", "", "P"),
            ("T_load", "T_air", "G*(T_air - T_load)"),
            ("T_air", "", "hA*(T_amb - T_air)"),
        ],
        _of("second_thermal_mass", "T_air"),
        every=20,
        hidden=1,
    ),
    "spindle": Machine(
        {"speed": ("rotation speed", "rpm", 2000, 12000, 1500, 0.25)},
        _spindle,
        {
            "T_bearing": (0.1, state(0)),
            "E_z": (
                0.3,
                lambda x, u, acts: (
                    1.2 * (x[:, 0] - 21) + 0.9 * (x[:, 1] - 21) + 2.0 * acts * (u["T_amb"] - 21)
                ),
            ),
        },
        {"T_bearing": 2200.0, "housing": 12000.0},
        free("loss", 300, "W")
        + free("G", 8, "W/K")
        + free("h1", 1, "W/K")
        + free("h2", 5, "W/K")
        + 'z1 = { start = 1.0, unit = "um/K" }\nz2 = { start = 1.0, unit = "um/K" }\n'
        + 'zero = { start = 0.0, unit = "um", per = "recording" }\n',
        [
            ("T_bearing", "", "loss*(speed/10000)**1.5"),
            ("housing", "T_bearing", "G*(T_bearing - housing)"),
            _ohm("1", "T_bearing"),
            _ohm("2", "housing"),
        ],
        _of("input_path", "E_z", output="E_z"),
        every=30,
        hours=8,
        errors={"E_z": "z1*(T_bearing - 21) + z2*(housing - 21) + zero"},
    ),
    "diode": Machine(
        {"P": (HEAT, "W", 30, 160, 900, 0.25)},
        _diode,
        {"T_d": (0.1, state(0)), "T_base": (0.1, state(1))},
        {"T_d": 260.0, "T_base": 1500.0},
        free("G", 1.0, "W/K") + free("h1", 0.3, "W/K") + free("h2", 2.0, "W/K"),
        [("T_d", "", "P"), ("T_base", "T_d", "G*(T_d - T_base)"), _ohm("1", "T_d"), _ohm("2", "T_base")],
        _of("radiation", "T_d", also=["natural_convection"]),
        every=12,
    ),
    "kiln": plate(
        _kiln,
        _of("radiation", "T_b", also=["natural_convection"]),
        drives={"P": (HEAT, "W", 300.0, 2500.0, 1500.0, 0.25)},
        outputs={"T_b": (0.5, state(0))},
        states={"T_b": 4000.0},
    ),
    "evaporation": plate(
        _evaporating,
        _of("out_of_catalogue", "T_b", also=["natural_convection", "radiation"], accepts=["unexplained"]),
    ),
    "jump": plate(key=_of("sensor_offset", "T_b", also=["rezero"]), changed=_jump),
    "noisy_power": plate(
        key=_of("out_of_catalogue", "T_b", accepts=["unexplained", "no mismatch"]), changed=_noisy
    ),
    "soaking": plate(
        _soaking,
        _of("second_thermal_mass", "T_b", also=["sensor_lag"]),
        outputs={"T_b": (0.05, lambda x, _, acts: lagged(x[:, 0], 45.0) if acts else x[:, 0])},
        hidden=1,
    ),
    "board": Machine(
        {"P1": (HEAT, "W", 5, 30, 700, 0.25), "P2": (HEAT, "W", 5, 30, 800, 0.25)},
        _board,
        {"T_1": (0.1, state(0)), "T_2": (0.1, state(1))},
        {"T_1": 60.0, "T_2": 70.0},
        free("h1", 0.5, "W/K") + free("h2", 0.5, "W/K"),
        [("T_1", "", "P1"), ("T_2", "", "P2"), _ohm("1", "T_1"), _ohm("2", "T_2")],
        _of("second_thermal_mass", "T_1", "T_2", also=["conduction_path"], accepts=["unexplained"]),
        every=10,
        hidden=1,
    ),
}
KINDS = {"nothing": (False, False), "late": (False, True), "effect": (True, False), "both": (True, True)}


def recorded(machine: Machine, rng: np.random.Generator, run: str, acts: bool, late: bool) -> pd.DataFrame:
    """One recording as a logger writes it."""
    count = machine.hours * 3600
    inputs = {n: steps(rng, count, *levels) for n, (_, _, *levels) in machine.drives.items()}
    inputs["T_amb"] = room(rng, count)
    x = np.empty((count, len(machine.states) + machine.hidden))
    now = np.full(x.shape[1], inputs["T_amb"][0])
    for k in range(count):
        x[k] = now
        now = now + np.array(machine.rates(now, {n: float(u[k]) for n, u in inputs.items()}, acts))
    shown = {n: np.array(show(x, inputs, acts)) for n, (_, show) in machine.outputs.items()}
    machine.changed(rng, run, inputs, shown, acts)
    at = np.arange(machine.every, count - machine.every, machine.every)
    begin = at - machine.every if late else at
    table = {"time": at.astype(float)}
    for name, series in inputs.items():
        sums = np.concatenate([[0.0], np.cumsum(series)])
        held = (sums[begin + machine.every] - sums[begin]) / machine.every
        table[name] = held if name in machine.drives else series[at] + 0.05 * rng.normal(size=len(at))
    for name, series in shown.items():
        table[name] = series[at] + machine.outputs[name][0] * rng.normal(size=len(at))
    return pd.DataFrame(table).round(4)


def write(folder: Path, seed: int) -> None:
    """All cases and their keys."""
    keys = {}
    for name, machine in MACHINES.items():
        for kind, (acts, _) in KINDS.items():
            write_case(folder / f"{name}_{kind}", name, kind, seed)
            keys[f"{name}_{kind}"] = dict(machine.key) if acts else {"effect": None, "states": []}
            print(f"wrote {name}_{kind}", flush=True)
    (folder / "keys.json").write_text(json.dumps(keys, indent=1) + "\n")


def write_case(case: Path, name: str, kind: str, seed: int) -> None:
    """Recordings, model and experiment of one machine."""
    machine, (acts, late) = MACHINES[name], KINDS[kind]
    place = [*MACHINES].index(name), [*KINDS].index(kind)
    case.mkdir(parents=True, exist_ok=True)
    for k, run in enumerate("abc"):
        rng = np.random.default_rng([seed, *place, k])
        recorded(machine, rng, run, acts, late).to_csv(case / f"{run}.csv", index=False)
    roles = {n: f'role = "{d[0]}", unit = "{d[1]}"' for n, d in machine.drives.items()}
    roles["T_amb"] = f'role = "{AMBIENT}", unit = "degC"'
    for n, (noise, _) in machine.outputs.items():
        role, unit = ("error", "um") if n in machine.errors else ("temperature", "degC")
        roles[n] = f'role = "{role}", unit = "{unit}", noise = {noise}'
    channels = "".join(f"{n} = {{ {text} }}\n" for n, text in roles.items())
    runs = "".join(f'{run} = {{ file = "{run}.csv" }}\n' for run in "abc")
    (case / "campaign.toml").write_text(f'name = "{case.name}"\n[channels]\n{channels}[recordings]\n{runs}')
    (case / "baseline.toml").write_text(machine.model(name))
    (case / "experiment.toml").write_text(
        f'name = "{case.name}"\ncampaign = "campaign.toml"\nfit = ["a", "b"]\nheld_out = ["c"]\n'
        '[models]\nbaseline = { file = "baseline.toml" }\n[mismatch]\nmodel = "baseline"\n'
    )


def main() -> None:
    """Write the cases."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    write(given.folder, given.seed)


if __name__ == "__main__":
    main()
