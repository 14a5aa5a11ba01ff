"""Recordings damaged in the ways of shop floors, one function each, and what `discovery check` says of them.

    python -m tests.recordings.damages

keeps the table of `benchmarks/damages.md`: sound recordings of the virtual machine and of two real heaters,
one of them damaged. For a damage that is not found, the table has the harm it does.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import isnan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.tables import keep
from discovery.dynamics import predict
from discovery.files import format_toml
from discovery.fitting import Fit, fit_model, predict_recording
from discovery.fitting.ridge import fit_ridge
from discovery.fitting.starts import warm_start
from discovery.models import read_model
from discovery.models.reduced import reduced
from discovery.models.superposition import superposition
from discovery.recordings import load_campaign
from discovery.recordings.check import check_campaign
from discovery.recordings.finding import Finding
from discovery.virtual.record import Order, take

Array = NDArray[np.float64]
Frame = dict[str, Array]
Frames = dict[str, Frame]

DATASETS = Path(__file__).parents[2] / "datasets"
TCLAB = DATASETS / "tclab"
HEATERS = (
    "random_both_01",
    "random_both_v2_02",
    "random_h1_03",
    "random_h2_04",
    "step_h1_up_080",
    "step_h2_up_060",
)
CHANNELS = {
    "machine": {
        "T_env": ("ambient temperature", "degC"),
        "T_fluid": ("fluid temperature", "degC"),
        "T_cool": ("coolant temperature", "degC"),
        "pump": ("fluid flow", "1"),
        "speed": ("rotation speed", "rpm"),
        "P_drive": ("heat load", "W"),
        "P_cool": ("cooling power", "W"),
        "E_Y0C": ("error", "um"),
        "E_Z0T": ("error", "um"),
        "E_R0T": ("error", "um"),
        "E_A0C": ("error", "um/m"),
    },
    "heaters": {
        "heater1": ("heat load", "percent"),
        "heater2": ("heat load", "percent"),
        "T1": ("temperature", "degC"),
        "T2": ("temperature", "degC"),
    },
}


@lru_cache(maxsize=2)
def sound(base: str) -> Mapping[str, Frame]:
    """Sound recordings: time and columns by name."""
    if base == "machine":
        orders = [Order(f"run{k}", cycle="fit", seed=40 + k, hours=48.0) for k in range(3)]
        orders.append(Order("run3", cycle="validation", seed=44, hours=48.0))
        return {one.name: _thin(take(one).columns, 5) for one in orders}
    campaign = load_campaign(TCLAB, only=HEATERS)
    return {
        name: {"time": one.time, **{c: one.values[c] for c in CHANNELS[base]}}
        for name, one in campaign.recordings.items()
    }


def _thin(columns: Mapping[str, Array], every: int) -> Frame:
    """Inputs every few rows; all readings."""
    read = np.isfinite(columns["E_Y0C"])
    read[::every] = True
    kept = ("time", *CHANNELS["machine"])
    return {name: np.asarray(columns[name], dtype=float)[read] for name in kept}


def write(folder: Path, base: str, frames: Mapping[str, Frame]) -> Path:
    """A campaign of such recordings."""
    return write_campaign(folder, base, CHANNELS[base], frames)


def write_campaign(
    folder: Path, title: str, roles: Mapping[str, tuple[str, str]], frames: Mapping[str, Frame]
) -> Path:
    """Recordings as CSV with a campaign file."""
    folder.mkdir(parents=True, exist_ok=True)
    channels = {name: {"role": role, "unit": unit} for name, (role, unit) in roles.items()}
    for name, frame in frames.items():
        header, rows = ",".join(frame), zip(*(one.tolist() for one in frame.values()), strict=True)
        lines = [",".join("" if isnan(v) else f"{v:.9g}" for v in row) for row in rows]
        (folder / f"{name}.csv").write_text("\n".join([header, *lines]) + "\n")
    recordings = {name: {"file": f"{name}.csv"} for name in frames}
    (folder / "campaign.toml").write_text(
        format_toml({"name": title, "channels": channels, "recordings": recordings})
    )
    return folder


@dataclass(frozen=True)
class Damage:
    """`channels`: one of them has to be named; () where the recording itself has to be."""

    name: str
    base: str
    recording: str
    channels: tuple[str, ...]
    make: Callable[[Frame], Frame]


def _set(name: str, to: Callable[[Array, Frame], Array]) -> Callable[[Frame], Frame]:
    return lambda frame: frame | {name: np.asarray(to(frame[name].copy(), frame), dtype=float)}


def _times(factor: float) -> Callable[[Frame], Frame]:
    """A clock that counts so many of its units where one has passed."""
    return lambda frame: frame | {"time": frame["time"] * factor}


def _late(names: tuple[str, ...], seconds: float) -> Callable[[Frame], Frame]:
    def made(frame: Frame) -> Frame:
        found = dict(frame)
        for name in names:
            known = np.isfinite(frame[name])
            t = frame["time"][known]
            found[name] = np.full(len(known), np.nan)
            found[name][known] = np.interp(t - seconds, t, frame[name][known])
        return found

    return made


def _swap(a: str, b: str) -> Callable[[Frame], Frame]:
    return lambda frame: frame | {a: frame[b], b: frame[a]}


def _half(factor: float, offset: float = 0.0) -> Callable[[Array, Frame], Array]:
    return lambda v, f: np.where(f["time"] > f["time"][-1] / 2, factor * v + offset, v)


def _rows(
    share: float, value: float | Callable[[Array], Array], seed: int = 1
) -> Callable[[Array, Frame], Array]:
    """Some readings replaced."""

    def made(values: Array, _: Frame) -> Array:
        known = np.flatnonzero(np.isfinite(values))
        rows = np.random.default_rng(seed).choice(known, max(1, round(share * known.size)), replace=False)
        values[rows] = value(values[rows]) if callable(value) else value
        return values

    return made


def _noisy(size: float) -> Callable[[Array, Frame], Array]:
    return lambda v, _: v + np.random.default_rng(2).normal(0, size, v.size)


def _from(share: float, to: Callable[[Array, float], Array]) -> Callable[[Array, Frame], Array]:
    """From a part of the recording on; `to` has the values and the last good one."""

    def made(values: Array, frame: Frame) -> Array:
        after = np.isfinite(values) & (frame["time"] > share * frame["time"][-1])
        before = values[np.isfinite(values) & ~after]
        values[after] = to(values[after], float(before[-1]))
        return values

    return made


def _frozen(values: Array, last: float) -> Array:
    return np.full(values.size, last)


ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
M, H = "machine", "heaters"


def _damages() -> list[Damage]:
    r, h = "run1", "random_both_v2_02"
    return [
        Damage("kW read as W", M, r, ("P_drive",), _set("P_drive", lambda v, _: v / 1e3)),
        Damage("kW read as W, cooling", M, r, ("P_cool",), _set("P_cool", lambda v, _: v / 1e3)),
        Damage("W read as kW", M, r, ("P_drive",), _set("P_drive", lambda v, _: v * 1e3)),
        Damage("1/s read as rpm", M, r, ("speed",), _set("speed", lambda v, _: v / 60)),
        Damage("speed ten times too large", M, r, ("speed",), _set("speed", lambda v, _: v * 10)),
        *(
            Damage(f"Fahrenheit read as Celsius, {n}", M, r, (n,), _set(n, lambda v, _: 1.8 * v + 32))
            for n in ("T_env", "T_fluid", "T_cool")
        ),
        Damage("kelvin read as Celsius", M, r, ("T_env",), _set("T_env", lambda v, _: v + 273.15)),
        Damage("Fahrenheit from half way on", M, r, ("T_fluid",), _set("T_fluid", _half(1.8, 32))),
        *(Damage(f"mm read as um, {n}", M, r, (n,), _set(n, lambda v, _: v / 1e3)) for n in ERRORS),
        Damage("nm read as um", M, r, ("E_Z0T",), _set("E_Z0T", lambda v, _: v * 1e3)),
        Damage("inches read as um", M, r, ("E_Y0C",), _set("E_Y0C", lambda v, _: v / 25.4e3)),
        Damage("errors ten times too small", M, r, ("E_Y0C",), _set("E_Y0C", lambda v, _: v / 10)),
        *(Damage(f"mm from half way on, {n}", M, r, (n,), _set(n, _half(1e-3))) for n in ("E_Y0C", "E_R0T")),
        *(Damage(f"sign of an error, {n}", M, r, (n,), _set(n, lambda v, _: -v)) for n in ERRORS),
        *(
            Damage(f"sign from half way on, {n}", M, r, (n,), _set(n, _half(-1.0)))
            for n in ("E_Y0C", "E_Z0T")
        ),
        Damage("sign of a power", M, r, ("P_drive",), _set("P_drive", lambda v, _: -v)),
        Damage("pump switch turned round", M, r, ("pump",), _set("pump", lambda v, _: 1 - v)),
        *(
            Damage(f"swapped: {a}, {b}", M, r, (a, b), _swap(a, b))
            for a, b in (
                ("E_Y0C", "E_Z0T"),
                ("E_Z0T", "E_R0T"),
                ("E_R0T", "E_A0C"),
                ("T_env", "T_fluid"),
                ("T_fluid", "T_cool"),
                ("T_env", "T_cool"),
                ("speed", "P_drive"),
                ("P_drive", "P_cool"),
            )
        ),
        Damage("all readings 3 h late", M, r, ERRORS, _late(ERRORS, 10800.0)),
        Damage("all readings 1 h early", M, r, ERRORS, _late(ERRORS, -3600.0)),
        Damage("a power 3 h late", M, r, ("P_drive",), _late(("P_drive",), 10800.0)),
        Damage("a speed 3 h late", M, r, ("speed",), _late(("speed",), 10800.0)),
        Damage("an error 3 h late", M, r, ("E_Y0C",), _late(("E_Y0C",), 10800.0)),
        Damage(
            "a clock one hour off",
            M,
            r,
            ("pump", "speed", "P_drive", "P_cool"),
            _late(("pump", "speed", "P_drive", "P_cool"), 3600.0),
        ),
        *(
            Damage(f"{word} read as seconds", M, r, (), _times(1 / k))
            for word, k in (("minutes", 60.0), ("hours", 3600.0), ("days", 86400.0), ("milliseconds", 1e-3))
        ),
        Damage("a clock that runs 20 % fast", M, r, (), _times(1.2)),
        Damage("missing readings as 0", M, r, ("T_fluid",), _set("T_fluid", _rows(0.05, 0.0))),
        Damage("missing errors as 0", M, r, ("E_Y0C",), _set("E_Y0C", _rows(0.05, 0.0))),
        Damage("missing readings as -999", M, r, ("T_env",), _set("T_env", _rows(0.03, -999.0))),
        Damage("missing errors as -999", M, r, ("E_A0C",), _set("E_A0C", _rows(0.03, -999.0))),
        Damage("missing errors as 9999", M, r, ("E_Y0C",), _set("E_Y0C", _rows(0.03, 9999.0))),
        Damage("a power at 3.4e38", M, r, ("P_drive",), _set("P_drive", _rows(0.01, 3.4e38))),
        Damage("ten outliers of 40 um", M, r, ("E_Y0C",), _set("E_Y0C", _rows(10 / 288, lambda v: v + 40))),
        Damage("ten outliers of 400 um", M, r, ("E_Y0C",), _set("E_Y0C", _rows(10 / 288, lambda v: v + 400))),
        Damage("one outlier of 4 mm", M, r, ("E_Z0T",), _set("E_Z0T", _rows(0.001, lambda v: v + 4000))),
        Damage("50 times the noise", M, r, ("E_Y0C",), _set("E_Y0C", _noisy(20.0))),
        Damage("20 times the noise, a temperature", M, r, ("T_fluid",), _set("T_fluid", _noisy(2.0))),
        Damage("a step of 25 um", M, r, ("E_Y0C",), _set("E_Y0C", _half(1.0, 25.0))),
        Damage("a step of 100 um", M, r, ("E_R0T",), _set("E_R0T", _half(1.0, 100.0))),
        Damage(
            "a drift of 60 um",
            M,
            r,
            ("E_Z0T",),
            _set("E_Z0T", lambda v, f: v + 60 * f["time"] / f["time"][-1]),
        ),
        Damage("a sensor 10 K too warm", M, r, ("T_fluid",), _set("T_fluid", lambda v, _: v + 10)),
        Damage("frozen from half way on", M, r, ("E_Z0T",), _set("E_Z0T", _from(0.5, _frozen))),
        Damage("frozen temperature", M, r, ("T_fluid",), _set("T_fluid", _from(0.3, _frozen))),
        Damage("frozen power", M, r, ("P_drive",), _set("P_drive", _from(0.3, _frozen))),
        Damage(
            "dead from the start",
            M,
            r,
            ("E_R0T",),
            _set("E_R0T", lambda v, _: np.where(np.isfinite(v), 0.0, v)),
        ),
        Damage(
            "a power saturated at 40 %",
            M,
            r,
            ("P_drive",),
            _set("P_drive", lambda v, _: np.minimum(v, 0.4 * np.nanmax(v))),
        ),
        Damage(
            "an error saturated",
            M,
            r,
            ("E_Y0C",),
            _set("E_Y0C", lambda v, _: np.clip(v, np.nanpercentile(v, 30), None)),
        ),
        Damage(
            "a temperature saturated",
            M,
            r,
            ("T_fluid",),
            _set("T_fluid", lambda v, _: np.minimum(v, np.nanpercentile(v, 40))),
        ),
        Damage("readings rounded to 10 um", M, r, ("E_Y0C",), _set("E_Y0C", lambda v, _: np.round(v, -1))),
        Damage("twice as large", M, r, ("E_Y0C",), _set("E_Y0C", lambda v, _: 2 * v)),
        Damage("a power half as large", M, r, ("P_drive",), _set("P_drive", lambda v, _: v / 2)),
        Damage(
            "an input that is the error",
            M,
            r,
            ("P_cool", "E_Y0C"),
            lambda f: f | {"P_cool": _held(f["E_Y0C"], 0.01)},
        ),
        Damage(
            "no stamp order", M, r, (), lambda f: f | {"time": np.concatenate((f["time"][1:], f["time"][:1]))}
        ),
        Damage(
            "a clock set back by an hour",
            M,
            r,
            (),
            lambda f: f | {"time": np.where(f["time"] > 9e4, f["time"] - 3600, f["time"])},
        ),
        Damage(
            "a gap of ten hours",
            M,
            r,
            (),
            lambda f: {n: v[(f["time"] < 5e4) | (f["time"] > 8.6e4)] for n, v in f.items()},
        ),
        Damage(
            "an input empty for ten hours",
            M,
            r,
            ("T_fluid",),
            _set("T_fluid", lambda v, f: np.where((f["time"] > 5e4) & (f["time"] < 8.6e4), np.nan, v)),
        ),
        Damage("infinite readings", M, r, ("E_Y0C",), _set("E_Y0C", _rows(0.01, np.inf))),
        # two real heaters
        Damage("heaters: swapped temperatures", H, "random_h1_03", ("T1", "T2"), _swap("T1", "T2")),
        Damage(
            "heaters: swapped heaters", H, "random_h1_03", ("heater1", "heater2"), _swap("heater1", "heater2")
        ),
        Damage("heaters: Fahrenheit", H, h, ("T1",), _set("T1", lambda v, _: 1.8 * v + 32)),
        Damage("heaters: minutes read as seconds", H, h, (), lambda f: f | {"time": f["time"] / 60}),
        Damage("heaters: hours read as seconds", H, h, (), lambda f: f | {"time": f["time"] / 3600}),
        Damage("heaters: a clock that runs 20 % fast", H, h, (), _times(1.2)),
        Damage("heaters: shares read as percent", H, h, ("heater1",), _set("heater1", lambda v, _: v / 100)),
        Damage("heaters: a temperature 5 min late", H, h, ("T1", "T2"), _late(("T1",), 300.0)),
        Damage("heaters: a heater 5 min late", H, h, ("heater1",), _late(("heater1",), 300.0)),
        Damage("heaters: frozen sensor", H, h, ("T2",), _set("T2", _from(0.5, _frozen))),
        Damage("heaters: zeros", H, h, ("T1",), _set("T1", _rows(0.02, 0.0))),
        Damage("heaters: -127 of a digital sensor", H, h, ("T1",), _set("T1", _rows(0.02, -127.0))),
        Damage(
            "heaters: climbs 22 K in 6 min",
            H,
            h,
            ("T2",),
            _set("T2", lambda v, f: v + 22 * np.clip((f["time"] - 4000) / 360, 0, 1)),
        ),
        Damage("heaters: starts at 48", H, "step_h1_up_080", ("T2",), _set("T2", lambda v, _: v + 25)),
        Damage("heaters: -180 throughout", H, h, ("T2",), _set("T2", lambda v, _: np.full(v.size, -180.0))),
    ]


def _held(values: Array, noise: float) -> Array:
    """Readings at every row, with a little noise: a column that is a copy of an error."""
    known = np.flatnonzero(np.isfinite(values))
    at = known[np.maximum(np.searchsorted(known, np.arange(len(values)), side="right") - 1, 0)]
    return np.asarray(values[at] + np.random.default_rng(3).normal(0, noise, len(values)))


DAMAGES = _damages()


def damaged(one: Damage) -> Frames:
    """The recordings with one of them damaged."""
    frames = {name: dict(frame) for name, frame in sound(one.base).items()}
    frames[one.recording] = one.make(frames[one.recording])
    return frames


def findings(one: Damage, folder: Path) -> list[Finding]:
    """What `discovery check` finds."""
    return check_campaign(write(folder, one.base, damaged(one)))


def is_named(one: Damage, found: list[Finding]) -> bool:
    """Whether a finding names the damaged recording, and a damaged channel where there is one."""
    for finding in found:
        text = str(finding)
        if f"{one.recording}.csv" in text and (
            not one.channels or finding.channel in one.channels or any(f"'{c}'" in text for c in one.channels)
        ):
            return True
    return False


def others(one: Damage, found: list[Finding]) -> list[Finding]:
    """Findings about recordings that are sound."""
    return [f for f in found if f.file.name not in (f"{one.recording}.csv", "campaign.toml")]


def harm(one: Damage) -> float:
    """How many times the held-out rms grows if a damaged recording of the machine is used in a fit.

    The largest factor of four kinds of models, fitted to the first three recordings and judged on the last
    one, as root mean square over the errors.
    """
    left = [_held_out_rms(frames) for frames in (sound(one.base), damaged(one))]
    return max(float(np.sqrt(np.mean((now / was) ** 2))) for was, now in zip(*left, strict=True))


def _held_out_rms(frames: Mapping[str, Frame]) -> list[Array]:
    """The held-out rms of each error, of each kind of model."""
    *fit, held_out = frames
    roles = CHANNELS["machine"] | {"h_nozzle": ("nozzle height", "mm")}
    whole = {name: {**one, "h_nozzle": np.full(len(one["time"]), 50.0)} for name, one in frames.items()}
    with tempfile.TemporaryDirectory() as folder:
        campaign = load_campaign(write_campaign(Path(folder), "harm", roles, whole))
    inputs = ["T_env", "P_drive", "T_fluid"]
    every = [name for name, channel in campaign.channels.items() if channel.is_input]

    def rms(found: Fit) -> Array:
        run = predict_recording(found.model, campaign, held_out, ERRORS, found.noise.white, zeros=found.zeros)
        return np.asarray(np.sqrt(np.nanmean((run.system.grid.readings - predict(run)) ** 2, axis=0)))

    found = [rms(fit_ridge(campaign, fit, ERRORS, every))]
    built = [build(inputs, ERRORS, campaign.channels) for build in (reduced, superposition)]
    models = [warm_start(model, campaign, fit, ERRORS) for model in built]
    models.append(read_model(DATASETS / "nmv5000" / "thermobalance.toml"))
    return found + [rms(fit_model(model, campaign, fit, ERRORS)) for model in models]


def main(only: str = "") -> None:
    """Print each damage, or those whose names hold a word, and what is found; keep the table of all."""
    rows = []
    for one in [d for d in DAMAGES if only in d.name]:
        with tempfile.TemporaryDirectory() as folder:
            found = findings(one, Path(folder))
        named = is_named(one, found)
        said = next((f for f in found if is_named(one, [f])), None) or (found[0] if found else None)
        what = said.what.replace("|", "/") if said else "-"
        elsewhere = f" +{len(others(one, found))} elsewhere" if others(one, found) else ""
        answer = "yes" if named else f"no; harm: {harm(one):.2f}" if one.base == M else "NO"
        rows.append((one.name, one.base, answer, what + elsewhere))
        print(*rows[-1], sep=" | ", flush=True)
    after = f"{sum(row[2] == 'yes' for row in rows)} of {len(rows)} found and named."
    print(after)
    if not only:
        head = ("damage", "recordings", "found", "first finding")
        keep("damages", "python -m tests.recordings.damages", head, rows, after)


if __name__ == "__main__":
    main(*sys.argv[1:2])
