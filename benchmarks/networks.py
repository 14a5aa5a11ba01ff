"""Networks of bodies with precise thermometers: python -m benchmarks.networks FOLDER [--seed NUMBER]

Most of them lack nothing. Three to five bodies in a chain, two powers, water that is switched, and air. Every
flow is off by 1 to 5 %, and stays so for 0.3 to 3 h. Thermometers read to 0.01 to 0.05 K. Inputs are means of
the interval after their stamp. Writes a case for each line of `CASES`, with `keys.json`.
`discovery challenge --cases-from FOLDER --no-baselines` then solves and scores them. Nothing here uses the
package.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP, HOURS = 10.0, 24.0
COUNT = int(HOURS * 3600 / STEP)
CASES = (  # share by which flows are off, noise [K], reading interval [s], what the model lacks
    (0.02, 0.02, 60, None),
    (0.02, 0.02, 120, None),
    (0.03, 0.02, 60, None),
    (0.01, 0.02, 60, None),
    (0.03, 0.05, 120, None),
    (0.02, 0.03, 300, None),
    (0.05, 0.05, 60, None),
    (0.02, 0.01, 60, None),
    (0.02, 0.02, 60, "conduction_path"),
    (0.02, 0.02, 60, "second_thermal_mass"),
)
ROLES = {
    "T_env": ("ambient temperature", "degC"),
    "T_cool": ("coolant temperature", "degC"),
    "P1": ("heat load", "W"),
    "P2": ("heat load", "W"),
    "flow": ("fluid flow", "1"),
}


@dataclass(frozen=True)
class Network:
    """Bodies in a chain: capacities [J/K], conduction to the next and to the air, and of the water [W/K]."""

    capacity: Array
    chain: Array
    air: Array
    water: float
    shares: Array  # of both powers that heat
    lacks: str | None

    @property
    def heated(self) -> int:
        """The body that the second power heats."""
        return len(self.capacity) // 2


def drawn(rng: np.random.Generator, lacks: str | None) -> Network:
    """A network."""
    count = int(rng.integers(3, 6))
    capacity = rng.uniform(5e3, 40e3, count) * np.where(rng.random(count) < 0.3, 3.0, 1.0)
    chain, air = rng.uniform(10, 60, count - 1), rng.uniform(3, 15, count)
    return Network(capacity, chain, air, float(rng.uniform(20, 60)), rng.uniform(0.5, 0.9, 2), lacks)


def wandering(rng: np.random.Generator, hours: float) -> Array:
    """First-order noise of unit variance."""
    kept = np.exp(-STEP / (3600 * hours))
    out = rng.standard_normal(COUNT)
    for k in range(1, COUNT):
        out[k] = kept * out[k - 1] + np.sqrt(1 - kept**2) * out[k]
    return out


def switched(rng: np.random.Generator, longest: float, levels: list[float]) -> Array:
    """A level that changes every 0.5 h to `longest` hours."""
    out = np.empty(COUNT)
    k = 0
    while k < COUNT:
        last = k + int(rng.uniform(0.5, longest) * 3600 / STEP)
        out[k:last] = rng.choice(levels)
        k = last
    return out


def inputs(rng: np.random.Generator) -> dict[str, Array]:
    """True inputs of a recording."""
    day = np.sin(2 * np.pi * np.arange(COUNT) * STEP / 86400 + rng.uniform(0, 6))
    return {
        "T_env": 21 + rng.uniform(-1, 1) + 1.5 * day + 0.3 * wandering(rng, 2.0),
        "T_cool": 20 + 0.5 * wandering(rng, 1.0),
        "P1": switched(rng, 3.0, [0, 0, 150, 300, 500]),
        "P2": switched(rng, 3.0, [0, 100, 250]),
        "flow": switched(rng, 4.0, [0, 1, 1]),
    }


def simulated(rng: np.random.Generator, one: Network, given: dict[str, Array], off: float) -> Array:
    """Temperatures (steps, bodies) [degC]."""
    bodies = len(one.capacity)
    hours = np.exp(rng.uniform(np.log(0.3), np.log(3), 2 * bodies + 2))
    wrong = np.array([1 + off * wandering(rng, h) for h in hours])
    links, airs, others = wrong[: bodies - 1], wrong[bodies - 1 : 2 * bodies - 1], wrong[2 * bodies - 1 :]
    x = given["T_env"][0] + rng.uniform(-0.5, 2, bodies)
    hidden, out = x[0], np.empty((COUNT, bodies))
    for k in range(COUNT):
        out[k] = x
        down = one.chain * (x[:-1] - x[1:]) * links[:, k]
        heat = one.air * (given["T_env"][k] - x) * airs[:, k]
        heat[:-1] -= down
        heat[1:] += down
        heat[0] += one.shares[0] * given["P1"][k] * others[0, k]
        heat[one.heated] += one.shares[1] * given["P2"][k] * others[1, k]
        heat[-1] += one.water * given["flow"][k] * (given["T_cool"][k] - x[-1]) * others[2, k]
        if one.lacks == "conduction_path":
            heat[0] -= 8 * (x[0] - x[-1])
            heat[-1] += 8 * (x[0] - x[-1])
        if one.lacks == "second_thermal_mass":
            heat[1] -= 15 * (x[1] - hidden)
            hidden += STEP * 15 * (x[1] - hidden) / 3e4
        x = x + STEP * heat / one.capacity
    return out


def baseline(rng: np.random.Generator, one: Network) -> str:
    """The model of an engineer: the same laws, with start values that are off by a quarter."""
    count = len(one.capacity)
    sizes = {f"G{i + 1}": (one.chain[i], "W/K") for i in range(count - 1)}
    sizes |= {f"A{i + 1}": (one.air[i], "W/K") for i in range(count)}
    sizes |= {"s1": (one.shares[0], "1"), "s2": (one.shares[1], "1"), "hc": (one.water, "W/K")}
    terms = [
        (f"conduction {i}", f"T{i}", f"G{i}*(T{i + 1} - T{i})", f'from = "T{i + 1}"\n')
        for i in range(1, count)
    ]
    terms += [(f"air {i}", f"T{i}", f"A{i}*(T_env - T{i})", "") for i in range(1, count + 1)]
    terms += [("power 1", "T1", "s1*P1", ""), ("power 2", f"T{one.heated + 1}", "s2*P2", "")]
    terms += [("water", f"T{count}", f"hc*flow*(T_cool - T{count})", "")]
    lines = ['name = "network"', "", "[parameters]"]
    lines += [
        f'{name} = {{ start = {value * rng.uniform(0.8, 1.25):.4g}, unit = "{unit}", min = 0.0 }}'
        for name, (value, unit) in sizes.items()
    ]
    lines += ["", "[states]"]
    lines += [
        f'T{i + 1} = {{ unit = "degC", capacity = {c * rng.uniform(0.97, 1.03):.0f}, start = "22" }}'
        for i, c in enumerate(one.capacity)
    ]
    lines += [
        f'\n[[terms]]\nname = "{name}"\ninto = "{into}"\n{source}expression = "{law}"'
        for name, into, law, source in terms
    ]
    return "\n".join(lines) + "\n"


def write(
    folder: Path, seed: int, off: float, noise: float, every: int, lacks: str | None
) -> dict[str, object]:
    """Write a case; return its key."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    one, rows = drawn(rng, lacks), int(every / STEP)
    bodies = [f"T{i + 1}" for i in range(len(one.capacity))]
    for run in "abc":
        given = inputs(rng)
        warm = simulated(rng, one, given, off)[::rows]
        read = warm + noise * rng.standard_normal(warm.shape)
        means = [series.reshape(-1, rows).mean(axis=1) for series in given.values()]
        table = np.column_stack([np.arange(len(read)) * float(every), *means, read])
        header = ",".join(["time", *given, *bodies])
        np.savetxt(folder / f"{run}.csv", table, "%.6g", ",", header=header, comments="")
    roles = ROLES | dict.fromkeys(bodies, ("temperature", "degC"))
    channels = "\n".join(f'{n} = {{ role = "{role}", unit = "{unit}" }}' for n, (role, unit) in roles.items())
    files = "\n".join(f'{run} = {{ file = "{run}.csv" }}' for run in "abc")
    campaign = f'name = "network"\n\n[channels]\n{channels}\n\n[recordings]\n{files}\n'
    (folder / "campaign.toml").write_text(campaign, "utf-8")
    (folder / "baseline.toml").write_text(baseline(rng, one), "utf-8")
    (folder / "experiment.toml").write_text(
        'name = "network"\ncampaign = "campaign.toml"\nfit = ["a", "b"]\nheld_out = ["c"]\n\n'
        '[models]\nbaseline = { file = "baseline.toml" }\n\n[mismatch]\nmodel = "baseline"\n',
        "utf-8",
    )
    states = {"conduction_path": ["T1", bodies[-1]], "second_thermal_mass": ["T2"]}
    return {"effect": lacks, "states": states.get(lacks or "", [])}


def main() -> None:
    """Write the cases."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.networks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    keys = {}
    for k, case in enumerate(CASES, 1):
        name = f"case_{k:02d}"
        keys[name] = write(given.folder / name, 100 * given.seed + k, *case)
    (given.folder / "keys.json").write_text(json.dumps(keys, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
