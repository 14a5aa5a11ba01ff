"""What `discovery record` does: options into orders, orders into files, a line of progress for each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from discovery.errors import UserError
from discovery.virtual.effects import EFFECTS, parse_request
from discovery.virtual.faults import FAULTS, parse_fault
from discovery.virtual.nmv5000 import CAMPAIGNS
from discovery.virtual.record import Order, draw_effect, write_answers, write_campaign


def orders_of(
    campaign: str | None,
    recordings: int,
    cycle: str,
    seed: int,
    hours: float,
    nozzle_height_mm: float,
    effects: Sequence[str],
    faults: Sequence[str],
    conceal: bool,
) -> tuple[str, tuple[Order, ...]]:
    """Title and orders of a campaign.

    Raises UserError: an unknown campaign, effect, fault, body or channel.
    """
    if campaign is not None:
        if campaign not in CAMPAIGNS:
            known = ", ".join(CAMPAIGNS)
            raise UserError(f"There is no campaign '{campaign}' to record; choose one of: {known}.")
        return CAMPAIGNS[campaign]
    for text in (*effects, *faults):
        if text.partition("=")[0].strip() == "help" or text.endswith("=help"):
            raise UserError(effect_list())
    requests = tuple(parse_request(text) for text in effects)
    if conceal:
        requests += (draw_effect(seed),)
    chain_faults = tuple(parse_fault(text) for text in faults)
    names = ["recording"] if recordings == 1 else [f"recording_{i + 1}" for i in range(recordings)]
    return f"virtual machine, seed {seed}", tuple(
        Order(
            name,
            cycle,
            seed + i,
            hours,
            nozzle_height_mm,
            requests,
            chain_faults if i == 0 else (),
            age=float(i),
        )
        for i, name in enumerate(names)
    )


def record_orders(
    out: Path, title: str, orders: Sequence[Order], *, reveal: bool, envelope: bool
) -> Iterator[str]:
    """Write the campaign and, with `envelope`, the answers beside it; yields what was done, line by line."""
    answers = write_campaign(out, title, orders)
    yield f"{len(orders)} recording{'s' if len(orders) > 1 else ''} and campaign.toml in {out}"
    if not any(a["effects"] or a["faults"] for a in answers):
        return
    if envelope:
        beside = out.resolve().parent / f"{out.resolve().name}.answer.json"
        write_answers(beside, answers)
        yield f"what is concealed stands in {beside}"
    if reveal:
        write_answers(out / "answer.json", answers)
        yield f"the answer stands in {out / 'answer.json'}"


def effect_list() -> str:
    """The effects and faults with unit, default place and law, one a line."""
    lines = ["choose an effect, then give its size:"]
    for name, e in EFFECTS.items():
        lines.append(f"  {name:24s} {e.low:g} to {e.high:g} {e.unit:5s} at {'+'.join(e.at):20s} {e.law}")
    lines.append("or a fault of the measuring chain:")
    for name, (_, channel, unit, example) in FAULTS.items():
        lines.append(f"  {name:24s} e.g. {example:g} {unit}" + (f" on {channel}" if channel else ""))
    return "\n".join(lines)
