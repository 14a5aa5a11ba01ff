"""How long the rows of a recording may be before wear is seen later: python -m benchmarks.row_length

Losses fall by 1 % a day, four errors every 2 h. A line for each span and kind of rows: residual, log odds of
wear of unknown size, and of the true wear known in advance.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.month import DAY, ERRORS, HOUR, TICK, World, machine, month, world
from discovery.export.document import Exported
from discovery.export.knowledge import problem_of, read_knowledge
from discovery.recordings import Campaign, Channel, Recording
from discovery.runtime.changes import make_table
from discovery.runtime.hypotheses import compare
from discovery.runtime.wear import uses

EVERY = round(2 * HOUR / TICK)  # ticks between two readings
KINDS = (("means", 1), ("means", 2), ("means", 5), ("means of what switches", 5), ("instants", 5))


def recorded(exported: Exported, seen: World, days: int, kind: str, ticks: int) -> Campaign:
    """The first days in rows of so many ticks; a row begins with each reading."""
    count = round(days * DAY / TICK) + 1
    time, read = seen.times[:count], np.arange(EVERY, count, EVERY)
    rows = np.union1d(np.arange(0, count, ticks), read)
    ends = np.append(rows[1:], count - 1)
    values, channels = {}, {}
    for spec in exported.inputs:
        series = seen.inputs[spec.name][:count]
        between = series[:-1] if spec.between == "held" else 0.5 * (series[1:] + series[:-1])
        integral = np.concatenate([[0.0], np.cumsum(between * np.diff(time))])
        length = np.maximum(time[ends] - time[rows], 1e-9)
        mean = np.where(ends > rows, (integral[ends] - integral[rows]) / length, series[rows])
        averaged = kind == "means" or (kind != "instants" and spec.between == "held")
        values[spec.name] = mean if averaged else series[rows]
        held = "held" if averaged or spec.between == "held" else "linear"
        channels[spec.name] = Channel(spec.name, spec.role, spec.unit, None, held)  # type: ignore[arg-type]
    for j, name in enumerate(ERRORS):
        values[name] = np.where(np.isin(rows, read), seen.probed[rows, j], np.nan)
        unit = next(o.unit for o in exported.outputs if o.name == name)
        channels[name] = Channel(name, "error", unit, None, "held")
    return Campaign("rows", channels, {"rows": Recording("rows", time[rows], values)}, Path("rows"))


def known(exported: Exported, campaign: Campaign, days: int) -> float:
    """Log odds of the true wear against no change."""
    knowledge = read_knowledge("rows", exported.document["knowledge"])
    problem = problem_of(exported.model, campaign, ["rows"], ERRORS)
    table, fitted = make_table(knowledge, problem, []), list(uses(exported))
    losses = [name for name in fitted if name.startswith("loss")]
    by = np.array([-0.01 * days * exported.model.parameters[name].value for name in losses])
    return table.seen().log_odds_of(table.at["bit by bit"][[fitted.index(n) for n in losses]], by)


def main() -> None:
    """Print all lines."""
    exported = machine()
    for seed, faults in ((4000, False), (4200, True)):
        seen = world(month(30, seed), seed, faults=faults, ageing=True)
        for days in (3, 4, 5, 6):
            for kind, ticks in KINDS:
                campaign = recorded(exported, seen, days, kind, ticks)
                found = compare(exported, campaign, ["rows"], named=False)
                print(
                    f"seed {seed}, {days} days, rows of {TICK * ticks:.0f} s, {kind}: {found.verdict}; "
                    f"residual {found.rms:.2f}, wear {found.odds['wear']:.1f}, "
                    f"known in advance {known(exported, campaign, days):.1f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
