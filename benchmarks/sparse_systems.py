"""Are discovered models sparse? Systems of hidden masses whose terms are known, through discovery and
through PySINDy.

    python benchmarks/sparse_systems.py two 1e5          # the two-output case
    python benchmarks/sparse_systems.py random 100       # random systems of two outputs, seeds 0 to 99
    python benchmarks/sparse_systems.py random 20 100    # seeds 100 to 119
    python benchmarks/sparse_systems.py random 20 0 --pysindy        # PySINDy on the same data, too
    python benchmarks/sparse_systems.py write 100 FOLDER # as CSV, for benchmarks/sparse_sysidentpy.py

Each random system: 3 to 6 inputs (one of them the air), two outputs, 1 to 3 masses each, time constants of
15 min to 8 h, 0.3 to 1 um noise, readings every 5 to 15 min, two recordings of 72 h to fit and one unseen.
"""

from __future__ import annotations

import json
import sys
import time as clock
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from discovery.dynamics import predict
from discovery.errors import UserError
from discovery.fitting import predict_recording
from discovery.frames import campaign_from_frames
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.sparse.discover import discover
from discovery.sparse.options import SparseOptions
from discovery.sparse.plain import fit_plain, settings
from discovery.terms import names

STEP = 60.0  # s, of the inputs


@dataclass(frozen=True)
class Mass:
    """A first-order response: um per unit of an input, s."""

    drive: str
    gain: float
    tau: float


def lagged(u: np.ndarray, tau: float, step: float) -> np.ndarray:
    """Response to an input that is held, exact; settled at first."""
    decay = np.exp(-step / tau)
    return u[0] + lfilter([0.0, 1 - decay], [1.0, -decay], u - u[0])


def inputs(rng: np.random.Generator, count: int, rows: int, step: float) -> dict[str, np.ndarray]:
    """Heat loads in steps of half an hour to three hours, and air of a daily swing and slow noise."""
    time = step * np.arange(rows)
    found = {}
    for k in range(count - 1):
        hold = int(rng.uniform(1800, 10800) / step)
        found[f"P{k}"] = np.repeat(rng.choice([0.0, 100.0, 200.0, 400.0], rows // hold + 1), hold)[:rows]
        found[f"P{k}"][0] = 0.0
    slow = np.cumsum(rng.standard_normal(rows)) * 0.01 * np.sqrt(step / 60)
    found["T_env"] = 21 + 2 * np.sin(2 * np.pi * time / 86400 + rng.uniform(0, 6)) + slow
    return found


def outputs(
    rng: np.random.Generator,
    u: dict[str, np.ndarray],
    truth: dict[str, list[Mass]],
    noise: float,
    step: float,
) -> dict[str, np.ndarray]:
    rows = len(next(iter(u.values())))
    return {
        y: sum(m.gain * lagged(u[m.drive] - 21 * (m.drive == "T_env"), m.tau, step) for m in masses)
        + noise * rng.standard_normal(rows)
        for y, masses in truth.items()
    }


def campaign_of(
    frames: dict[str, pd.DataFrame], truth: dict[str, list[Mass]], noise: float | None
) -> Campaign:
    roles = {c: ("heat load", "W") for c in frames["a"] if c.startswith("P")}
    roles |= {"T_env": ("ambient temperature", "degC")} | dict.fromkeys(truth, ("error", "um"))
    channels = {c: {"role": role, "unit": unit} for c, (role, unit) in roles.items()}
    for y in truth:
        channels[y] |= {"noise": noise} if noise else {}
    return campaign_from_frames(frames, channels)


def random_system(seed: int) -> tuple[Campaign, dict[str, list[Mass]]]:
    rng = np.random.default_rng(seed)
    count, noise = int(rng.integers(3, 7)), float(rng.uniform(0.3, 1.0))
    drives = [f"P{k}" for k in range(count - 1)] + ["T_env"]
    truth = {}
    for y in ("E_Y", "E_Z"):
        chosen = rng.choice(drives, int(rng.integers(1, 4)), replace=False)
        truth[y] = [
            Mass(
                str(d),
                float(
                    rng.choice([-1, 1])
                    * np.exp(rng.uniform(*np.log((0.5, 3) if d == "T_env" else (0.01, 0.05))))
                ),
                float(np.exp(rng.uniform(np.log(900), np.log(28800)))),
            )
            for d in chosen
        ]
    frames, rows = {}, int(72 * 3600 / STEP)
    for name in ("a", "b", "unseen"):
        u = inputs(rng, count, rows, STEP)
        table = pd.DataFrame(u | outputs(rng, u, truth, noise, STEP), index=STEP * np.arange(rows))
        read = np.zeros(rows, dtype=bool)
        stamps = np.cumsum(np.r_[0, rng.integers(5, 16, rows // 5)])
        read[stamps[stamps < rows]] = True
        table.loc[~read, list(truth)] = np.nan
        frames[name] = table
    return campaign_of(frames, truth, None), truth


def two(rows: int, seed: int = 0) -> tuple[Campaign, dict[str, list[Mass]]]:
    """E_Y: 0.02 um/W of P0 at 3600 s, 0.5 um/K of the air at 7200 s; E_Z: P1 at 5400 s, P2 at 1800 s."""
    rng = np.random.default_rng(seed)
    truth = {
        "E_Y": [Mass("P0", 0.02, 3600.0), Mass("T_env", 0.5, 7200.0)],
        "E_Z": [Mass("P1", 0.03, 5400.0), Mass("P2", 0.01, 1800.0)],
    }
    u = inputs(rng, 4, rows, 1.0)
    table = pd.DataFrame(u | outputs(rng, u, truth, 0.3, 1.0), index=np.arange(float(rows)))
    return campaign_of({"a": table}, truth, 0.3), truth


def found_masses(model: Model, output: str) -> list[Mass]:
    """What a discovered model of hidden masses says, as masses."""
    found = []
    for term in model.terms:
        if not term.into.startswith(f"{output}_") or term.name.endswith(" settles"):
            continue
        own = names(term.expression)
        gain = next(n for n in own if "_gain" in n)
        tau = next((n for n in own if "_tau" in n), None)
        drive = next(iter(own - set(model.parameters) - set(model.states)))
        found.append(
            Mass(drive, model.parameters[gain].value, model.parameters[tau].value if tau else np.inf)
        )
    direct = names(model.outputs[output]) - set(model.states) - set(model.parameters)
    return found + [Mass(d, np.nan, 0.0) for d in direct]


def compare(found: list[Mass], truth: list[Mass]) -> tuple[int, int, list[float], list[float]]:
    """Masses that are missing, that are too many, shares by which gains and time constants are off."""
    rest, gains, taus = list(found), [], []
    for mass in truth:
        near = [m for m in rest if m.drive == mass.drive and m.tau > 0]
        best = min(near, key=lambda m: abs(np.log(m.tau / mass.tau)), default=None)
        if best is not None:
            rest.remove(best)
            gains.append(abs(best.gain / mass.gain - 1))
            taus.append(abs(best.tau / mass.tau - 1))
    return len(truth) - len(gains), len(rest), gains, taus


def holding_zero(model: Model, output: str) -> int:
    """Gains whose 95 % interval holds zero."""
    return sum(
        p.low is None or p.high is None or p.low <= 0 <= p.high
        for name, p in model.parameters.items()
        if name.startswith(f"{output}_gain")
    )


def unseen(model: Model, campaign: Campaign, output: str) -> float:
    run = predict_recording(model, campaign, "unseen", [output])
    return float(np.sqrt(np.nanmean((run.system.grid.readings - predict(run)) ** 2)))


def report_two(rows: int) -> None:
    campaign, truth = two(rows)
    began = clock.process_time()
    model = discover(campaign, ["a"], list(truth), SparseOptions(bootstraps=0)).model
    print(f"{rows} readings, {clock.process_time() - began:.1f} s of processor time")
    for y, masses in truth.items():
        missing, spurious, gains, taus = compare(found_masses(model, y), masses)
        worst = [f"{100 * max(some, default=np.nan):.2f} %" for some in (gains, taus)]
        print(
            f"{y}: missing {missing}, too many {spurious}, gains within {worst[0]}, time constants {worst[1]}"
        )


def report_random(count: int, first: int) -> None:
    exact = outputs_exact = true = extra = zero = 0
    all_gains, all_taus, left = [], [], {"discovery": [], "PySINDy plain": [], "PySINDy weak": []}
    same_inputs = dict.fromkeys(("PySINDy plain", "PySINDy weak"), 0)
    began = clock.process_time()
    for seed in range(first, first + count):
        campaign, truth = random_system(seed)
        model = discover(campaign, ["a", "b"], list(truth), SparseOptions(bootstraps=0)).model
        right = True
        for y, masses in truth.items():
            missing, spurious, gains, taus = compare(found_masses(model, y), masses)
            right &= not missing and not spurious
            outputs_exact += not missing and not spurious
            true, extra, zero = true + len(masses), extra + spurious, zero + holding_zero(model, y)
            all_gains += gains
            all_taus += taus
            left["discovery"].append(unseen(model, campaign, y))
            if missing or spurious:
                print(
                    f"  seed {seed} {y}: missing {missing}, too many {spurious}",
                    masses,
                    found_masses(model, y),
                )
        exact += right
        drives = [c for c in campaign.channels if c not in truth]
        for form in ("plain", "weak") if "--pysindy" in sys.argv else ():
            name = f"PySINDy {form}"
            for y, masses in truth.items():
                try:
                    fit, _, _ = fit_plain(campaign, ["a", "b"], [y], drives, settings(form))
                    used = {n for t in fit.model.terms for n in names(t.expression)} & set(drives)
                    same_inputs[name] += used == {m.drive for m in masses}
                    left[name].append(unseen(fit.model, campaign, y))
                except UserError:
                    left[name].append(np.inf)
        done = seed - first + 1
        off = [f"{100 * np.median(some):.2f} %" for some in (all_gains, all_taus)]
        rms = ", ".join(f"{n} {np.median(v):.2f} um" for n, v in left.items() if v)
        same = "".join(f"; {n}: same inputs in {k} of {2 * done}" for n, k in same_inputs.items() if left[n])
        print(
            f"{done} systems: exact set in {exact}, outputs {outputs_exact} of {2 * done}; {extra} too many "
            f"beside {true} true terms, {zero} intervals hold zero; median off: gains {off[0]}, time "
            f"constants {off[1]}; median rms held out: {rms}{same}; {clock.process_time() - began:.0f} s",
            flush=True,
        )


def write(count: int, folder: Path) -> None:
    """The recordings and the true masses of the first systems: SEED_a.csv, SEED_b.csv, SEED_unseen.csv,
    SEED.json.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(count):
        campaign, truth = random_system(seed)
        for name, one in campaign.recordings.items():
            pd.DataFrame(one.values, index=pd.Index(one.time, name="time")).to_csv(
                folder / f"{seed}_{name}.csv"
            )
        masses = {y: [asdict(m) for m in some] for y, some in truth.items()}
        (folder / f"{seed}.json").write_text(json.dumps(masses))


if __name__ == "__main__":
    if sys.argv[1] == "two":
        report_two(int(float(sys.argv[2])))
    elif sys.argv[1] == "write":
        write(int(sys.argv[2]), Path(sys.argv[3]))
    else:
        numbers = [int(a) for a in sys.argv[2:] if a.isdigit()]
        report_random(numbers[0], numbers[1] if len(numbers) > 1 else 0)
