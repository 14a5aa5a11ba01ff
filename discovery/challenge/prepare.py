"""The cases of a challenge: written, their answers put aside, both sealed."""

from __future__ import annotations

import json
import secrets
import shutil
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from discovery.challenge.seal import ANSWERS, CASES, SEAL, read_seal, write_seal
from discovery.errors import UserError
from discovery.files import read_text, write_atomic
from discovery.progress import Progress
from discovery.virtual.cases import Case, draw_kinds, make_case

CONTRACT = (
    "experiment.toml",
    "campaign.toml",
    "baseline.toml",
)  # and recordings; nothing else goes into a case
MEASURING = frozenset({"sensor_offset", "sensor_drift", "sensor_lag", "outlier", "clock_shift", "rezero"})


@dataclass(frozen=True)
class Order:
    """One case to be made."""

    name: str
    seed: int
    kind: str


def draw_orders(count: int, seed: int) -> list[Order]:
    """Cases of a challenge; the title of a case is its number.

    Of the cases without effect every second one has slow noise and small heat, which make_case takes from the
    parity of its seed.
    """
    rng = np.random.default_rng([seed, 7])
    orders, quiet = [], 0
    for number, kind in enumerate(draw_kinds(count, seed), start=1):
        own = 2 * int(rng.integers(2**30))
        if kind == "none":
            own, quiet = own + quiet % 2, quiet + 1
        orders.append(Order(f"case_{number:03d}", own, kind))
    return orders


def make(order: Order) -> Case:
    """The case of an order."""
    return make_case(order.seed, order.kind, order.name.replace("_", " "))


def prepare(folder: Path, count: int, seed: int, jobs: int, progress: Progress) -> dict[str, Any]:
    """Write and seal `count` cases drawn from `seed`.

    Returns:
        The seal.

    Raises:
        UserError: `folder` holds something else already.
    """
    begin(folder)
    answers: dict[str, Any] = {"salt": secrets.token_hex(32), "seed": seed, "cases": {}}
    orders = draw_orders(count, seed)
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for done, (order, case) in enumerate(zip(orders, pool.map(make, orders), strict=True), start=1):
            for name, content in case.files.items():
                write_atomic(folder / CASES / order.name / name, content)
            answers["cases"][order.name] = case.key
            progress(f"writing case {done} of {count}")
    return _close(folder, answers)


def adopt(folder: Path, source: Path) -> dict[str, Any]:
    """Take over cases that exist: folders with an experiment.toml, keys beside them.

    Returns:
        The seal.

    Raises:
        UserError: no keys there, a key without its case, or `folder` holds something else already.
    """
    keys = read_keys(source)
    root = source / CASES if (source / CASES).is_dir() else source
    begin(folder)
    for name in keys:
        files = [
            p
            for p in sorted((root / name).glob("*"))
            if p.name in CONTRACT or p.name.endswith((".csv", ".csv.gz", ".parquet"))
        ]
        if not any(p.name == "experiment.toml" for p in files):
            raise UserError(f"{root / name}: no experiment.toml there, though the keys name this case")
        for path in files:
            write_atomic(folder / CASES / name / path.name, path.read_bytes())
    return _close(folder, {"salt": secrets.token_hex(32), "seed": None, "cases": keys})


def read_keys(source: Path) -> dict[str, Any]:
    """Keys by case from `source`/answers.json or keys.json. Raises UserError."""
    path = next((source / name for name in (ANSWERS, "keys.json") if (source / name).is_file()), None)
    if path is None:
        raise UserError(
            f"{source}: neither {ANSWERS} nor keys.json there; name the folder of the cases and their keys"
        )
    try:
        found = json.loads(read_text(path))
        keys = found["cases"] if path.name == ANSWERS else found
        return {name: key | {"kind": kind_of(key)} for name, key in sorted(keys.items())}
    except (ValueError, KeyError, TypeError, AttributeError):
        raise UserError(f"{path}: not keys by the name of their case, each with effect and states") from None


def kind_of(key: dict[str, Any]) -> str:
    """What kind of case a key describes, where it does not say."""
    if "kind" in key:
        return str(key["kind"])
    effect = key["effect"]
    if effect is None:
        return "none"
    if "unexplained" in key.get("accepts", []):
        return "outside"
    return "two" if "effects" in key else "measuring" if effect in MEASURING else "one"


def begin(folder: Path) -> None:
    """An empty folder for a challenge. What an interrupted preparation left is cleared. Raises UserError."""
    if (folder / SEAL).exists():
        raise UserError(f"{folder}: holds a challenge already; choose another place with --out")
    strange = [p.name for p in folder.iterdir() if p.name not in (CASES, ANSWERS)] if folder.is_dir() else []
    if strange:
        raise UserError(
            f"{folder}: holds '{strange[0]}', which is no challenge; choose another place with --out"
        )
    shutil.rmtree(folder / CASES, ignore_errors=True)


def _close(folder: Path, answers: dict[str, Any]) -> dict[str, Any]:
    write_atomic(folder / ANSWERS, json.dumps(answers, indent=1) + "\n")
    return write_seal(folder)


def opened(folder: Path) -> Sequence[str]:
    """Names of the cases of a sealed challenge."""
    return sorted({name.split("/")[0] for name in read_seal(folder)["cases"]})
