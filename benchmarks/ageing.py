"""Does `discovery update` say what happened? Unchanged machines, wear, a faulty sensor, and new physics.

    python benchmarks/ageing.py [first seed] [recordings] [file that keeps what is done]

Part one: recordings of an unchanged machine, each compared alone: how many would write a revision. Part two:
the five cases of an outside review, three recordings of 72 h each, with all readings and with eight a day.
Part three: days on which losses fall by 1 % each, an update every day with eight readings since the last
revision; the error is judged on all readings of the next day, which no update has seen.

With a file, a run that was stopped goes on where it was; without one it begins anew.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import predict as model_outputs
from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal
from discovery.fitting import fit_model, predict_recording
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.recordings import Campaign, Recording, load_campaign
from discovery.runtime.hypotheses import compare
from discovery.runtime.update import revision_of
from discovery.virtual.machine import Machine
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import Order, Request, take

DATA = Path(__file__).parents[1] / "datasets" / "nmv5000"
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
Values = dict[str, NDArray[np.float64]]


def worn(share: float) -> tuple[Request, ...]:
    """Losses that reach the bodies, as a share of those of a new machine."""
    return tuple(Request("wear", 1.0 - share, (body,)) for body in ("c_body_1", "c_body_2"))


def recorded(
    campaign: Campaign,
    count: int,
    hours: float,
    seed: int,
    *,
    plant: Machine | None = None,
    effects: tuple[Request, ...] = (),
    readings: int | None = None,
    spoil: Callable[[Values], None] = lambda _: None,
    cycle: str = "fit",
) -> Campaign:
    """Recordings of a machine; `readings`: so many a day, None: all (every 10 to 15 min)."""
    found = {}
    for k in range(count):
        order = Order(f"r{k}", cycle, seed + k, hours, machine=plant or five_axis(), effects=effects, age=1.0)
        columns = take(order).columns
        values = {name: series.copy() for name, series in columns.items() if name != "time"}
        if readings is not None:
            read = np.flatnonzero(np.isfinite(values[ERRORS[0]]))
            chosen = read[np.linspace(0, len(read) - 1, round(readings * hours / 24.0)).astype(int)]
            for name in ERRORS:
                keep = np.isin(np.arange(len(columns["time"])), chosen)
                values[name] = np.where(keep, values[name], np.nan)
        spoil(values)
        found[f"r{k}"] = Recording(f"r{k}", columns["time"], values)
    return replace(campaign, recordings=found)


def sealed(model: Model, campaign: Campaign) -> Exported:
    """The fitted model, as a runtime reads it."""
    return from_document(*open_seal(render(make_document(model, campaign, ["fit"])), "model"), "model")


@dataclass
class Done:
    """Results by name, in a file that a later run reads."""

    path: Path | None
    results: dict[str, list[str | float]] = field(default_factory=dict)

    def __call__(self, name: str, ask: Callable[[], list[str | float]]) -> list[str | float]:
        """A result: the one that is kept, else a new one."""
        if name not in self.results:
            self.results[name] = ask()
            if self.path:
                self.path.write_text(json.dumps(self.results, indent=0))
        return self.results[name]


def unchanged(exported: Exported, campaign: Campaign, first: int, count: int, done: Done) -> None:
    """How often an unchanged machine would be changed."""
    for title, hours, readings, cycle in (
        ("24 h, eight readings", 24.0, 8, "fit"),
        ("24 h, all readings", 24.0, None, "fit"),
        ("72 h, all readings, other cycle", 72.0, None, "validation"),
    ):

        def asked(
            seed: int, hours: float = hours, readings: int | None = readings, cycle: str = cycle
        ) -> list[str | float]:
            one = recorded(campaign, 1, hours, seed, readings=readings, cycle=cycle)
            found = compare(exported, one, ["r0"])
            signed = revision_of(exported, one, found) is not None
            most = max(v for n, v in found.odds.items() if n != "nothing")
            return [found.verdict + (", revision" if signed else ""), found.odds["wear"], most]

        rows = [
            done(f"{title}, {seed}", lambda seed=seed: asked(seed))  # type: ignore[misc]
            for seed in range(first, first + count)
        ]
        wear, most = (max(float(row[k]) for row in rows) for k in (1, 2))
        print(
            f"unchanged, {title}: {dict(Counter(row[0] for row in rows))} of {count}; "
            f"largest log odds {most:.1f}, of wear {wear:.1f}",
            flush=True,
        )


def cases(exported: Exported, campaign: Campaign, seed: int, done: Done) -> None:
    """The five cases of the review."""

    def warm(values: Values) -> None:
        values["T_env"] = values["T_env"] + 1.5

    fresh = five_axis()
    fan = fresh.scaled("air", 1.6)
    gap = (Request("flooded_gap", 25.0, ("c_body_1", "b_body_1")),)
    hysteresis = (Request("joint_hysteresis", 1.5, ("E_Y0C",)),)
    for readings in (None, 8):
        given = "all readings" if readings is None else f"{readings} readings a day"
        changes: tuple[tuple[str, dict[str, Any]], ...] = (
            ("flooded gap 25 W/K", {"effects": gap}),
            ("fan, air +60 %", {"plant": fan}),
            ("room sensor +1.5 K", {"spoil": warm}),
            ("hysteresis of a joint, 1.5 um", {"effects": hysteresis}),
            ("wear, losses -10 %", {"effects": worn(0.9)}),
        )
        for title, options in changes:

            def asked(
                readings: int | None = readings, options: dict[str, Any] = options
            ) -> list[str | float]:
                these = recorded(campaign, 3, 72.0, seed, readings=readings, **options)
                found = compare(exported, these, list(these.recordings))
                signed = revision_of(exported, these, found) is not None
                return [f"{found}; {'revision' if signed else 'no revision'}"]

            print(f"{title}, {given}: {done(f'{title}, {given}', asked)[0]}", flush=True)


def error_left(model: Model, campaign: Campaign) -> float:
    """rms over all errors of a free run, E_A0C weighed as um at 0.35 m."""
    trajectory = predict_recording(model, campaign, "r0", ERRORS)
    residual = trajectory.system.grid.readings - model_outputs(trajectory)
    residual[:, 3] *= 0.35
    return float(np.sqrt(np.nanmean(residual[1:] ** 2)))


def days(exported: Exported, campaign: Campaign, seed: int, count: int) -> None:
    """Losses fall by 1 % a day."""
    first, since, rows = exported, list[Recording](), []
    for day in range(1, count + 1):
        whole = recorded(campaign, 1, 24.0, seed + day, effects=worn(1.0 - 0.01 * (day - 1)))
        rows.append((error_left(exported.model, whole), error_left(first.model, whole)))
        few = recorded(campaign, 1, 24.0, seed + day, effects=worn(1.0 - 0.01 * (day - 1)), readings=8)
        since.append(replace(few.recordings["r0"], name=f"day_{day}"))
        seen = replace(campaign, recordings={one.name: one for one in since})
        found = compare(exported, seen, list(seen.recordings))
        revised = revision_of(exported, seen, found)
        if revised is not None:
            exported = from_document(*open_seal(render(revised[0]), "model"), "model")
            since.clear()
        print(f"day {day}: left {rows[-1][0]:.2f}, {rows[-1][1]:.2f} without; {found.verdict}", flush=True)
    left = np.array(rows)
    print(
        f"day one {left[0, 0]:.2f} um; last seven days: {left[-7:, 0].mean():.2f} um with updating, "
        f"{left[-7:, 1].mean():.2f} um without; {exported.revision - 1} revisions"
    )


def main(seed: int, count: int, kept: Path | None = None) -> None:
    """Print all three parts."""
    began = time.perf_counter()
    done = Done(kept, json.loads(kept.read_text()) if kept and kept.is_file() else {})
    campaign = load_campaign(DATA / "campaign.toml", only=["fit"])
    exported = sealed(fit_model(read_model(DATA / "thermobalance.toml"), campaign, ["fit"]).model, campaign)
    unchanged(exported, campaign, seed, count, done)
    cases(exported, campaign, seed + 1000, done)
    days(exported, campaign, seed + 2000, 30)
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    words = sys.argv[1:] + ["9000", "60"][len(sys.argv) - 1 :]
    main(int(words[0]), int(words[1]), *(Path(word) for word in words[2:3]))
