"""The cases of a challenge: written, their answers put aside, both sealed."""

from __future__ import annotations

import json
import secrets
import shutil
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import cycle
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from discovery.challenge.seal import ANSWERS, CASES, SEAL, read_seal, write_seal
from discovery.errors import UsageError, UserError
from discovery.files import read_text, write_atomic
from discovery.progress import Progress
from discovery.virtual.cases import FAULTS, Case, Plan, draw_plans, make_case
from discovery.virtual.families import FAMILIES

CONTRACT = (
    "experiment.toml",
    "campaign.toml",
    "baseline.toml",
)  # and recordings; nothing else goes into a case
MEASURING = frozenset(FAULTS)


@dataclass(frozen=True)
class Order:
    """One case to be made."""

    name: str
    family: str
    seed: int
    plan: Plan


def draw_orders(families: Sequence[str], count: int, seed: int) -> list[Order]:
    """Cases of a challenge, families in turn; the name of a case is its number.

    Raises:
        UsageError: a family that does not exist.
    """
    for family in families:
        if family not in FAMILIES:
            raise UsageError(f"There is no family '{family}'; choose from: {', '.join(FAMILIES)}.")
    rng = np.random.default_rng([seed, 7])
    plans = {f: iter(draw_plans(f, -(-count // len(families)), seed)) for f in families}
    digits = max(2, len(str(count)))
    return [
        Order(f"case_{k + 1:0{digits}d}", family, int(rng.integers(2**31)), next(plans[family]))
        for k, family in zip(range(count), cycle(families), strict=False)
    ]


def make(order: Order) -> Case:
    """The case of an order."""
    return make_case(order.family, order.seed, order.plan, order.name.replace("_", " "))


def made(orders: Sequence[Order], jobs: int, progress: Progress) -> Iterator[tuple[Order, Case]]:
    """The cases of some orders, as they get ready."""
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for done, (order, case) in enumerate(zip(orders, pool.map(make, orders), strict=True), start=1):
            yield order, case
            progress(f"writing case {done} of {len(orders)}")


def prepare(
    folder: Path, families: Sequence[str], count: int, seed: int, jobs: int, progress: Progress
) -> dict[str, Any]:
    """Write and seal `count` cases drawn from `seed`.

    Returns:
        The seal.

    Raises:
        UserError: `folder` holds something else already.
    """
    orders = draw_orders(families, count, seed)
    begin(folder)
    answers: dict[str, Any] = {
        "salt": secrets.token_hex(32),
        "seed": seed,
        "families": list(families),
        "cases": {},
    }
    for order, case in made(orders, jobs, progress):
        write_case(folder / CASES / order.name, case)
        answers["cases"][order.name] = case.key
    return _close(folder, answers)


def practise(
    folder: Path, families: Sequence[str], count: int, seed: int, jobs: int, progress: Progress
) -> None:
    """Write cases to practise on: folders `case_01`, ... and `keys.json` in the same place, nothing sealed.

    Raises:
        UserError: `folder` holds something else already.
    """
    orders = draw_orders(families, count, seed)
    if folder.is_dir() and any(folder.iterdir()):
        raise UserError(f"{folder}: not empty; choose another folder with --write")
    keys = {}
    for order, case in made(orders, jobs, progress):
        write_case(folder / order.name, case)
        keys[order.name] = case.key
    write_atomic(folder / "keys.json", json.dumps(keys, indent=1) + "\n")


def write_case(folder: Path, case: Case) -> None:
    """The files of a case, into its folder."""
    for name, content in case.files.items():
        write_atomic(folder / name, content)


def adopt(folder: Path, source: Path) -> dict[str, Any]:
    """Take over cases that exist: folders with an experiment.toml, and their keys in the same place.

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
    if str(effect).startswith("input_"):
        return "input"
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
